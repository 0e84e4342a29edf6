use super::*;
use crate::reference::*;
#[test]
fn scratch() {
    for gj in [0.77, 10.0] {
        for m in [0.5, 1.5, 3.0, 4.0, 5.0, 6.283185307179586] {
            let mut case = unit_rod(32);
            case.rod.section[0].gj = Some(gj);
            case.load = vec![at_end(LoadKind::Moment, [0.0, 0.0, m])];
            let p = StaticProblem::new(&case).unwrap();
            let s = p.solve_state().unwrap();
            let o = p.solution(&s);
            println!("gj {gj} m {m} tip {:?} it {} {:?} {} {:?} E {:?} {:?}", o.tip, o.iterations, o.inertia, o.stable, o.stop, o.energy.twist,
              s.report.steps.iter().map(|s| (s.fraction, s.shift, s.residual)).collect::<Vec<_>>());
        }
    }
}
