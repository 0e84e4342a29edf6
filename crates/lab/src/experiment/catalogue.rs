//! Navigation with devices of the catalogue: the instruments, and the stages of the procedure.

use std::path::Path;

use endowire_core::Result;
use endowire_core::control::{Controller, FollowPath, Follower, SearchAhead, Team};
use endowire_core::device::{DeviceFile, Instrument, Stack};
use endowire_core::vessel::CentrelineTree;

/// End of a stage.
#[derive(Debug, Clone, Copy)]
pub(super) enum Until {
    /// The tip is at most this far before the end of the way, mm.
    BeforeTarget(f64),
    /// The tip is at most this far before a target on the way, mm.
    Before(&'static str, f64),
}

/// A stage: the leading instrument, the followers with their distances behind it (mm), and its end.
#[derive(Debug)]
pub(super) struct Stage {
    lead: usize,
    followers: &'static [(usize, f64)],
    until: Until,
    /// Instruments that are rotated in a search; `None` to follow the centre line.
    searched: Option<&'static [usize]>,
}

/// A vessel, instruments from the innermost outwards, and the stages of the procedure.
#[derive(Debug)]
pub struct Procedure {
    /// The built-in anatomy.
    pub anatomy: &'static str,
    /// Targets in it.
    pub targets: &'static [&'static str],
    devices: &'static [&'static str],
    /// Length of elements, mm.
    pub element_mm: f64,
    pub(super) stages: Vec<Stage>,
}

/// The wire leads with its floppy part exposed, and the catheter follows over it.
fn over_the_wire() -> Vec<Stage> {
    vec![
        Stage { lead: 0, followers: &[(1, 100.0)], until: Until::BeforeTarget(6.0), searched: None },
        Stage { lead: 1, followers: &[], until: Until::BeforeTarget(25.0), searched: None },
    ]
}

/// The catheter passes the branches into the ascending aorta, where its limb turns back, with the wire inside it. It
/// is then pulled back until its tip is in the ostium of the branch, at most `hooked_mm` before the target, and held
/// there while the wire advances to the target. A bent catheter is not simply pushed after the wire, which would
/// drive its knee into the ascending aorta: it is rotated, pushed and pulled.
fn pulled_back(hooked_mm: f64) -> Vec<Stage> {
    let (past, hooked) = (Until::Before("ascending aorta", 40.0), Until::BeforeTarget(hooked_mm));
    vec![
        Stage { lead: 1, followers: &[(0, 5.0)], until: past, searched: None },
        Stage { lead: 1, followers: &[(0, 5.0)], until: hooked, searched: Some(&[1]) },
        Stage { lead: 0, followers: &[], until: Until::BeforeTarget(6.0), searched: None },
        Stage { lead: 1, followers: &[], until: Until::BeforeTarget(25.0), searched: Some(&[1]) },
    ]
}

/// The cobra catheter hooks the coeliac trunk, then the microwire leads and the microcatheter follows.
fn coaxial() -> Vec<Stage> {
    let trunk = Until::Before("coeliac trunk", 6.0);
    vec![
        Stage { lead: 2, followers: &[(0, 5.0), (1, 5.0)], until: trunk, searched: Some(&[2]) },
        Stage { lead: 0, followers: &[(1, 15.0)], until: Until::BeforeTarget(6.0), searched: Some(&[0]) },
        Stage { lead: 1, followers: &[], until: Until::BeforeTarget(12.0), searched: None },
    ]
}

/// All vessels with their instruments and targets. Branches from the ascending part of the arch are hooked with a
/// Simmons catheter, since a wire from below would have to turn back.
pub fn procedures() -> Vec<Procedure> {
    let vertebral = |anatomy, targets| Procedure {
        anatomy,
        targets,
        devices: &["wire_035_bentson_shaped", "catheter_4f_vertebral"],
        element_mm: 4.0,
        stages: over_the_wire(),
    };
    let simmons = |anatomy, targets, hooked_mm| Procedure {
        anatomy,
        targets,
        devices: &["wire_035_hydrophilic_angled", "catheter_5f_simmons_1"],
        element_mm: 4.0,
        stages: pulled_back(hooked_mm),
    };
    vec![
        vertebral("aortic_arch", &["innominate", "left carotid", "left subclavian"]),
        vertebral("aortic_arch_ii", &["innominate", "left subclavian"]),
        simmons("aortic_arch_ii", &["left carotid"], 72.0),
        vertebral("aortic_arch_iii", &["left subclavian"]),
        simmons("aortic_arch_iii", &["innominate"], 48.0),
        simmons("aortic_arch_iii", &["left carotid"], 72.0),
        Procedure {
            anatomy: "hepatic",
            targets: &["right hepatic", "left hepatic"],
            devices: &["microwire_014_shaped", "microcatheter_27f", "catheter_5f_cobra_c2"],
            element_mm: 2.0,
            stages: coaxial(),
        },
    ]
}

impl Procedure {
    /// The instruments, read from the files in a folder.
    ///
    /// # Errors
    /// A file that is missing, or whose device does not go over the one within it.
    pub fn stack(&self, folder: &Path) -> Result<Stack> {
        let each = self.devices.iter().map(|name| {
            let device = DeviceFile::read(&folder.join(format!("{name}.toml")))?.device;
            Ok(Instrument { name: (*name).to_owned(), device, may_lead: true })
        });
        Stack::new(each.collect::<Result<_>>()?)
    }

    /// Names of the instruments, for the table.
    pub fn instruments(&self) -> String {
        self.devices.join(" + ")
    }
}

impl Stage {
    /// The controller of a stage on the way to a target; `None` if the tree has no such way.
    pub(super) fn controller(
        &self,
        tree: &CentrelineTree,
        target: &str,
    ) -> Result<Option<Box<dyn Controller>>> {
        let to = match self.until {
            Until::Before(on_the_way, _) => on_the_way,
            Until::BeforeTarget(_) => target,
        };
        let Some(path) = tree.path_to(tree.target(to)?.row) else { return Ok(None) };
        let (Until::Before(_, before_mm) | Until::BeforeTarget(before_mm)) = self.until;
        let followers = self.followers.iter();
        let followers =
            followers.map(|&(instrument, behind_mm)| Follower { instrument, behind_mm }).collect();
        let team = Team { lead: self.lead, followers };
        Ok(Some(match self.searched {
            Some(turned) => Box::new(SearchAhead::new(path, team, turned.to_vec(), before_mm)),
            None => Box::new(FollowPath::new(path, team, before_mm)),
        }))
    }
}

#[cfg(test)]
mod tests {
    use endowire_core::vessel::anatomy;

    use super::*;

    #[test]
    fn every_procedure_has_its_targets_and_instruments() {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets/devices");
        let mut targets = 0;
        for procedure in procedures() {
            let tree = anatomy::tree(procedure.anatomy).unwrap();
            let stack = procedure.stack(&folder).unwrap();
            assert_eq!(stack.instruments().len(), procedure.devices.len());
            for target in procedure.targets {
                assert!(procedure.stages.iter().all(|s| s.controller(&tree, target).unwrap().is_some()));
                targets += 1;
            }
        }
        assert_eq!(targets, 11);
    }
}
