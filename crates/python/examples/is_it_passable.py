"""Ask whether a device passes to a target, before anything is simulated: by room and by bends."""

import endowire

vessel = endowire.Vessel.generate("hepatic")
devices = endowire.assets_path() / "devices"
for name in ("microwire_014_shaped", "microcatheter_27f", "catheter_4f_vertebral", "sheath_6f_long"):
    device = endowire.Instrument.read(devices / f"{name}.toml")
    answer = vessel.passable(device, "right hepatic", force_n=0.1)
    narrowest, sharpest = answer["narrowest"], answer["sharpest"]
    print(
        f"{name}: {answer['passage']}, comes {answer['reaches_mm']:.0f} of {answer['length_mm']:.0f} mm; "
        f"{narrowest['clearance_mm']:.2f} mm of room at {narrowest['arc_mm']:.0f} mm, "
        f"a bend of {sharpest['cut_radius_mm']:.1f} mm at {sharpest['arc_mm']:.0f} mm"
    )
