"""What comes with the package."""

import endowire


def test_a_scene_of_the_package_finds_its_vessel_and_device():
    scene = endowire.Scene(endowire.assets_path() / "scenes" / "arch_carotid.toml")
    assert scene.simulation().step(advance_mm=2.0).inserted_mm > 0.0


def test_the_catalogue_is_there():
    devices = sorted((endowire.assets_path() / "devices").glob("*.toml"))
    assert len(devices) > 20
    assert all(endowire.Instrument.read(device) for device in devices)
