use endowire_core::device::*; use endowire_core::insertion::*; use endowire_core::methods::*; use endowire_core::methods::kirchhoff::*; use endowire_core::vessel::*;
use std::time::Instant;
fn arg(i: usize, d: f64) -> f64 { std::env::args().nth(i).and_then(|s| s.parse().ok()).unwrap_or(d) }
fn main(){
 let name=std::env::args().nth(1).unwrap(); let h=arg(2,1.0); let l=arg(3,2.0); let kappa=arg(4,0.0); let total=arg(5,300.0); let op=arg(6,1.0) as usize;
 let wall=Wall::from_surface(&SurfaceMesh::read(std::path::Path::new(&name),1.0).unwrap()).unwrap();
 let mut s0=Section::straight(30.,0.445,5.0); s0.rest_curvature_per_mm=[kappa,0.];
 let d=Device::new(vec![s0,Section::straight(120.,0.445,8.),Section::straight(50.,0.445,15.),Section::straight(400.,0.445,60.)]).unwrap();
 let mesh=wall.mesh().clone();
 let sheath=Sheath::at_opening(&wall,op,2.0).unwrap();
 let c=Instant::now();
 let mut sim=Simulation::with_properties(wall,WallProperties{modulus_n_per_mm2:1.0},d,sheath,&MethodChoice::Kirchhoff(KirchhoffOptions{element_mm:l,..Default::default()})).unwrap();
 println!("setup {:.2}s tris {}",c.elapsed().as_secs_f64(), mesh.triangles.len());
 let n=(total/h).round() as usize; let mut times=vec![]; let mut its=0; let mut subs=0; let mut jumps=0; let mut pen=0.0f64;let mut itv=vec![];
 for i in 0..n { let cmd=Command{advance_mm:h,rotate_rad:if kappa>0.0{0.02*h}else{0.0}}; let c=Instant::now(); let r=match sim.step(cmd) { Ok(r)=>r.clone(), Err(e)=>{println!("step {i}: {e}"); break;} }; times.push(c.elapsed().as_secs_f64()*1e6); its+=r.iterations; itv.push(r.iterations); subs+=r.substeps; jumps+=r.jumped as u32; pen=pen.max(r.max_penetration_mm);
  if (i+1)%(n/10).max(1)==0 { println!("{:.1} F={:.5} M={:.4} E={:.5} {:.5} {:.5} pen {:.3} c {} it {} sub {} tip {:?}", r.inserted_mm,r.push_force_n,r.torque_nmm,r.energy.bend,r.energy.twist,r.energy.wall,r.max_penetration_mm,r.contacts.len(),r.iterations,r.substeps,{let t=sim.shape().tip_mm().unwrap();(t.x.round(),t.y.round(),t.z.round())}); } }
 times.sort_by(f64::total_cmp); itv.sort();
 if times.is_empty(){return;}
 println!("steps {} it/step {:.2} med it {} subs {} jumps {} maxpen {:.3} median us {:.0} p99 {:.0} max {:.0} us/it {:.1} counters {:?}",times.len(),its as f64/times.len() as f64,itv[itv.len()/2],subs,jumps,pen,times[times.len()/2],times[times.len()*99/100],times[times.len()-1],times.iter().sum::<f64>()/its as f64,sim.report().counters);
}
