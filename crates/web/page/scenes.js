// The scenes of the menu.
export const SCENES = [
  ["scenes/arch_carotid.toml", "Arch: left carotid artery"],
  ["scenes/arch_innominate.toml", "Arch: innominate artery"],
  ["scenes/arch_subclavian.toml", "Arch: left subclavian artery"],
  ["scenes/arch_vertebral.toml", "Arch: wire in a vertebral catheter"],
  ["scenes/arch_steered.toml", "Arch: catheter with a steered tip"],
  ["scenes/arch_plaque.toml", "Arch: aneurysm and plaque"],
  ["scenes/arch_angiography.toml", "Arch: angiography"],
  ["scenes/aortic_arch.toml", "Arch: shaped wire in a patient"],
  ["scenes/coil.toml", "Aneurysm: coil into its sac"],
  ["scenes/hepatic.toml", "Liver: arteries at rest"],
  ["scenes/hepatic_breathing.toml", "Liver: breathing"],
  ["scenes/curved_tube_exact.toml", "Curved tube"],
  ["scenes/curved_tube_friction.toml", "Curved tube with friction"],
  ["scenes/curved_tube.toml", "Curved tube by the method of Li et al. 2011"],
  ["scenes/loop.toml", "Loop of a soft tip"],
];
