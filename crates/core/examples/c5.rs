use endowire_core::device::*; use endowire_core::insertion::*; use endowire_core::methods::*; use endowire_core::methods::kirchhoff::*; use endowire_core::vessel::*; use endowire_core::Vec3;
fn arg(i: usize, d: f64) -> f64 { std::env::args().nth(i).and_then(|s| s.parse().ok()).unwrap_or(d) }
fn tube(straight: f64, r: f64, end: f64, radius: f64) -> CentrelineTree {
 let mut n=vec![]; let mut push=|x:f64,y:f64|{ let p=if n.is_empty(){None}else{Some(n.len()-1)}; n.push(CentrelineNode{position_mm:Vec3::new(x,y,0.),radius_mm:radius,parent:p}); };
 let k=(straight/1.0).round() as usize; for i in 0..k { push(straight*i as f64/k as f64,0.); }
 let a=(r*1.5707963/1.0).round() as usize; for i in 0..=a { let t=1.5707963267948966*i as f64/a as f64; push(straight+r*t.sin(), r-r*t.cos()); }
 let k=(end/1.0).round() as usize; for i in 1..=k { push(straight+r, r+end*i as f64/k as f64); }
 CentrelineTree::new(n).unwrap() }
fn main(){
 let edge=arg(1,0.3); let h=arg(2,1.0); let inc=arg(3,1.0);
 let g=GeneratedWall::new(&tube(20.,30.,10.,3.0), Resolution::EdgeMm(edge)).unwrap();
 println!("triangles {}", g.wall.mesh().triangles.len());
 let d=Device::uniform(100.,0.45,10.0).unwrap();
 let sheath=Sheath::new(Vec3::zeros(),Vec3::x()).unwrap();
 let mut sim=Simulation::with_properties(g.wall,WallProperties{modulus_n_per_mm2:1.0},d,sheath,&MethodChoice::Kirchhoff(KirchhoffOptions{element_mm:h,..Default::default()})).unwrap();
 let n=(40.0/inc).round() as usize; for _ in 0..n { sim.step(Command::advance(inc)).unwrap(); }
 let r=sim.report(); let t=sim.shape().tip_mm().unwrap();
 let sum:f64=r.contacts.iter().map(|c|c.force_n).sum();
 println!("tip ({:.6},{:.6},{:.6}) err {:.6}", t.x,t.y,t.z, (t-Vec3::new(39.744407,4.116002,0.)).norm());
 let e=|n:&str,a:f64,b:f64| println!("{n} {a:.8} expected {b:.8} rel {:.2e}", (a-b)/b);
 e("bend",r.energy.bend,0.00399283); e("wall",r.energy.wall,0.00000551); e("sumF",sum,0.002241); e("tip pen",r.contacts.first().map_or(0.,|c|c.penetration_mm),0.004922); e("push",r.push_force_n,0.00106708);
}
