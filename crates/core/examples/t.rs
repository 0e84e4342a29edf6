use endowire_core::device::*; use endowire_core::insertion::*; use endowire_core::methods::*; use endowire_core::methods::kirchhoff::*; use endowire_core::vessel::*;
use std::time::Instant;
fn arg(i: usize, d: f64) -> f64 { std::env::args().nth(i).and_then(|s| s.parse().ok()).unwrap_or(d) }
fn main() -> endowire_core::Result<()> {
 let m=SurfaceMesh::read(std::path::Path::new("assets/vessels/curved_tube.stl"),1.0)?;
 let wall=Wall::from_surface(&m)?;
 let sheath=Sheath::new(endowire_core::Vec3::new(0.,0.,1.),endowire_core::Vec3::z())?;
 let h=arg(1,1.0); let ei=arg(2,5.0); let k=arg(3,1.0); let l=arg(4,2.0); let total=arg(5,230.0);
 let d=Device::uniform(400.,0.445,ei)?;
 let mut sim=Simulation::with_properties(wall,WallProperties{modulus_n_per_mm2:k},d,sheath,&MethodChoice::Kirchhoff(KirchhoffOptions{element_mm:l,..Default::default()}))?;
 let n=(total/h).round() as usize; let mut tt=0.0; let mut its=0; let mut subs=0; let mut work=0.0; let mut lastf=0.0; let mut worst=0.0f64;
 for i in 0..n { let c=Instant::now(); let r=match sim.step(Command::advance(h)) { Ok(r)=>r.clone(), Err(e)=>{println!("{e}"); break;} }; let dt=c.elapsed().as_secs_f64(); tt+=dt; worst=worst.max(dt); its+=r.iterations; subs+=r.substeps;
  work+=0.5*(lastf+r.push_force_n)*h; lastf=r.push_force_n;
  if (i+1)%(n/23).max(1)==0 { println!("{:.1} F={:.6} E={:.6} {:.6} work {:.6} pen {:.4} contacts {} it {} sub {} jump {} tip {:?}", r.inserted_mm,r.push_force_n,r.energy.bend,r.energy.wall,work,r.max_penetration_mm,r.contacts.len(),r.iterations,r.substeps,r.jumped,{let t=sim.shape().tip_mm().unwrap();((t.x*1e4).round()/1e4,(t.y*1e4).round()/1e4,(t.z*1e4).round()/1e4)}); } }
 println!("steps {n} it/step {:.2} sub/step {:.2} step us {:.1} worst {:.1} us/it {:.2} counters {:?}",its as f64/n as f64,subs as f64/n as f64,tt/n as f64*1e6,worst*1e6,tt*1e6/its as f64,sim.report().counters);
 Ok(())
}
