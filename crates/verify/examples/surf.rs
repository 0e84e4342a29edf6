//! surf DIR PATTERN [limit_s]
use endowire_verify::surfaces::*;
use std::path::Path;
use std::sync::Mutex;
use std::sync::atomic::*;
use std::time::Instant;
fn main() {
    let a: Vec<String> = std::env::args().collect();
    let pat = a.get(2).cloned().unwrap_or_default();
    let full = a.iter().any(|x| x == "full");
    let mut jobs = vec![];
    let surfaces: Vec<Surface> = surfaces_in(Path::new(&a[1]))
        .unwrap()
        .iter()
        .filter(|f| {
            let first = pat.split_whitespace().next().unwrap_or("");
            !first.contains(|c: char| c.is_alphabetic() && false)
                && (std::env::var("S").map_or(true, |s| f.name.starts_with(&s)))
        })
        .map(|f| Surface::read(f).unwrap())
        .collect();
    for s in &surfaces {
        for c in cells(s.places.len(), full) {
            if matches(&c.name_in(s), &pat) {
                jobs.push((s, c));
            }
        }
    }
    let start = Instant::now();
    let clock = || start.elapsed().as_secs_f64();
    let next = AtomicUsize::new(0);
    let rows = Mutex::new(vec![]);
    let limit: f64 = std::env::var("L").ok().and_then(|l| l.parse().ok()).unwrap_or(120.);
    let threads: usize = std::env::var("J").ok().and_then(|l| l.parse().ok()).unwrap_or(2);
    std::thread::scope(|sc| {
        for _ in 0..threads {
            sc.spawn(||{ while let Some((s,c))=jobs.get(next.fetch_add(1,Ordering::SeqCst)){
        let r=run(s,c,limit,&clock);
        println!("{:<8} {:<58} {:6.1} {:4} it {:6} most {:5} /mm {:4.0} med {:6.2} slow {:7.1} pen {:.3} j {} resort {} cross {}x{:.2} {}",r.ending.name(),r.name,r.inserted_mm,r.steps,r.iterations,r.most_iterations,r.most_iterations_per_mm,r.median_ms,r.slowest_ms,r.max_penetration_mm,r.jumps,r.relaxations,r.crossings,r.missing_mm,r.message.as_deref().filter(|_|!r.ending.is_good()||r.ending==Ending::Blocked).unwrap_or(""));
        rows.lock().unwrap().push(r);
    }});
        }
    });
    let rows = rows.into_inner().unwrap();
    println!("{}", Summary::of(&rows));
}
