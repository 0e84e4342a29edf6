"""The registered tasks, and the files of the original ones."""

import base64
import contextlib
import json
import warnings
import zlib

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

import endowire
import endowire.gym
from endowire.gym import originals

VIEW = {"views": ["3d"], "size_px": [32, 32], "backend": "cpu"}


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("name", ["BasicWireNav", "DualDeviceNav", "CathSim", "Navigation"])
def test_registered_ids_pass_the_checker(name):
    # That a vessel stands in for another is warned of, and reported.
    warned = contextlib.nullcontext()
    if name != "Navigation":
        warned = pytest.warns(UserWarning, match=f"{name}: the built-in")
    with warned:
        env = gymnasium.make(f"endowire/{name}-v0", render_mode="rgb_array", view=VIEW).unwrapped
        # It makes another.
        check_env(env)
    env.reset(seed=3)
    for _ in range(8):
        *_, info = env.step(env.action_space.high.reshape(-1, 2) * np.array([0.5, 0.2], dtype=np.float32))
    assert info["failure"] == ""
    assert info.get("stand_in", "").startswith("aortic_arch in place of") == (name != "Navigation")


def test_vessels_that_are_given_stand_in_for_nothing():
    vessels = endowire.gym.vessels.FixedVessel(endowire.Vessel.generate("aortic_arch", edge_mm=4.0))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        env = gymnasium.make("endowire/CathSim-v0", vessels=vessels)
    assert "stand_in" not in env.reset(seed=1)[1]


def pushed_to_the_wall(env):
    for _ in range(60):
        _, _, terminated, _, info = env.step(np.array([[0.9, 0.0]]))
        if info["wall_force_n"] > 0.0:
            return {**info, "terminated": terminated}
    raise AssertionError("no contact")


def test_a_navigation_ends_where_it_is_not_safe():
    env = gymnasium.make("endowire/Navigation-v0", target="innominate", force_limit_n=0.0).unwrapped
    env.reset(seed=1)
    assert np.allclose(env.episodes.target_mm[0], env.task.vessels.site.vessel.targets["innominate"])
    touched = pushed_to_the_wall(env)
    assert touched["safety"] < 1.0 and not touched["terminated"]
    env = gymnasium.make("endowire/Navigation-v0", ends=[endowire.gym.ends.ForceLimit(0.0)]).unwrapped
    env.reset(seed=1)
    touched = pushed_to_the_wall(env)
    assert touched["terminated"] and touched["safety"] == 1.0
    with pytest.raises(endowire.InputError, match="target = 'left foot': aortic_arch has ascending aorta"):
        gymnasium.make("endowire/Navigation-v0", target="left foot")


def curve(path, points, radius):
    points = [{"position": point} for point in points.tolist()]
    radii = {"name": "Radius", "controlPointValues": [radius] * len(points)}
    markup = {"controlPoints": points, "measurements": [{"name": "length"}, radii]}
    path.write_text(json.dumps({"markups": [markup]}))


def test_the_vessel_of_dual_device_nav_is_read_from_its_files(tmp_path):
    # In the original's axes: (x, y, z) becomes (y, -z, -x).
    table = np.array(
        [[65.0, -5.0, 20.0, 12.0, -1], [65.0, -5.0, 60.0, 12.0, 0], [65.0, -5.0, 130.0, 12.0, 1]]
    )
    made = endowire.Vessel.generate(table, edge_mm=4.0)
    back = np.array([[0.0, 0.0, -1.0], [1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])
    endowire.Vessel.from_arrays(made.vertices_mm @ back.T, made.triangles).write(
        tmp_path / "vessel_architecture_collision.obj"
    )
    lines = tmp_path / "Centrelines_comb"
    lines.mkdir()
    along = np.array([0.0, 0.0, 1.0])
    start = np.array([65.0, -5.0, 25.0])
    trunk = start + np.arange(11)[:, None] * 5.0 * along
    branch = trunk[-1] + np.arange(9)[::-1, None] * 5.0 * along
    curve(lines / "Centerline curve (0).mrk.json", trunk @ back.T, 4.0)
    curve(lines / "Centerline curve - LCCA.mrk.json", branch @ back.T, 4.0)
    vessels = originals.dual_device_nav(tmp_path)
    assert np.allclose(vessels.site.vessel.vertices_mm.mean(axis=0), made.vertices_mm.mean(axis=0), atol=0.5)
    line = vessels.site.centreline
    assert len(line.positions_mm) == 19 and line.lengths_mm == pytest.approx([5.0] * 18)
    targets = line.positions_mm[1:][vessels.site.targets]
    assert targets[:, 2].min() == pytest.approx(85.0) and targets[:, 2].max() == pytest.approx(115.0)
    env = gymnasium.make("endowire/DualDeviceNav-v0", data=tmp_path).unwrapped
    env.reset(seed=1)
    for _ in range(5):
        *_, info = env.step(np.array([[1.0, 0.2], [0.6, 0.0]]))
    assert info["failure"] == ""
    (lines / "Centerline curve (0).mrk.json").write_text("{}")
    with pytest.raises(endowire.InputError, match=r"curve \(0\).*no curve of 3D Slicer"):
        originals.dual_device_nav(tmp_path)
    with pytest.raises(endowire.InputError, match="vessel_architecture_collision.obj"):
        originals.dual_device_nav(tmp_path / "nowhere")


def vtp_file(path, vessel, kind):
    arrays = {
        "points": vessel.vertices_mm.astype("<f8"),
        "connectivity": vessel.triangles.astype("<i8"),
        "offsets": 3 * np.arange(1, len(vessel.triangles) + 1, dtype="<i8"),
    }
    appended, parts, compressor = b"", {}, ""
    for name, array in arrays.items():
        data = array.tobytes()
        if kind == "ascii":
            parts[name] = ('format="ascii"', " ".join(str(v) for v in array.ravel().tolist()))
        elif kind == "binary":
            text = base64.b64encode(len(data).to_bytes(4, "little") + data).decode()
            parts[name] = ('format="binary"', text)
        else:
            compressor = 'compressor="vtkZLibDataCompressor"'
            blocks = [zlib.compress(data[k : k + 4096]) for k in range(0, len(data), 4096)]
            header = [len(blocks), 4096, len(data) % 4096, *map(len, blocks)]
            head, body = np.array(header, dtype="<u4").tobytes(), b"".join(blocks)
            parts[name] = (f'format="appended" offset="{len(appended)}"', "")
            appended += head + body if kind == "raw" else base64.b64encode(head) + base64.b64encode(body)

    def one(name, type_, more=""):
        attributes, text = parts[name]
        return f'<DataArray type="{type_}" Name="{name}" {more} {attributes}>{text}</DataArray>'

    three = 'NumberOfComponents="3"'
    text = (
        f'<?xml version="1.0"?><VTKFile type="PolyData" byte_order="LittleEndian" {compressor}><PolyData><Piece>'
        f"<Points>{one('points', 'Float64', three)}</Points>"
        f"<Polys>{one('connectivity', 'Int64')}{one('offsets', 'Int64')}</Polys></Piece></PolyData>"
    ).encode()
    if appended:
        encoding = b"raw" if kind == "raw" else b"base64"
        text += b'<AppendedData encoding="' + encoding + b'">_' + appended + b"</AppendedData>"
    path.write_bytes(text + b"</VTKFile>")


@pytest.mark.parametrize("kind", ["ascii", "binary", "raw", "base64"])
def test_surfaces_of_vtk_are_read(vessel, tmp_path, kind):
    vtp_file(tmp_path / "a.vtp", vessel, kind)
    read = endowire.Vessel.read(tmp_path / "a.vtp")
    assert np.array_equal(read.vertices_mm, vessel.vertices_mm)
    assert np.array_equal(read.triangles, vessel.triangles)
    with pytest.warns(UserWarning, match="if the file is in millimetres"):
        turned = endowire.Vessel.read(tmp_path / "a.vtp", unit_mm=10.0, axes="RAS")
    assert np.array_equal(turned.vertices_mm, 10.0 * vessel.vertices_mm * [-1.0, -1.0, 1.0])
    with pytest.raises(endowire.InputError, match="LAS"):
        endowire.Vessel.read(tmp_path / "a.vtp", axes="LAS")
    assert endowire.check_vessel(tmp_path / "a.vtp", axes="LPS")["sound"]
    damaged = (tmp_path / "a.vtp").read_bytes()
    for end in (0, 100, len(damaged) // 3):
        (tmp_path / "a.vtp").write_bytes(damaged[:end])
        with pytest.raises(endowire.InputError, match="a.vtp"):
            endowire.Vessel.read(tmp_path / "a.vtp")


def test_pieces_of_a_surface_keep_their_own_points(tmp_path):
    def array(name, type_, numbers):
        text = " ".join(map(str, numbers))
        return f'<DataArray type="{type_}" Name="{name}" format="ascii">{text}</DataArray>'

    def piece(points, corners):
        connectivity = array("connectivity", "Int32", np.ravel(corners))
        offsets = array("offsets", "Int32", 3 * np.arange(1, len(corners) + 1))
        return (
            f"<Piece><Points>{array('Points', 'Float32', np.ravel(points))}</Points>"
            f"<Polys>{connectivity}{offsets}</Polys></Piece>"
        )

    def read(*pieces):
        text = f'<VTKFile type="PolyData"><PolyData>{"".join(pieces)}</PolyData></VTKFile>'
        (tmp_path / "a.vtp").write_text(text)
        return endowire.Vessel.read(tmp_path / "a.vtp")

    corners = np.array([[0, 0, 0], [10, 0, 0], [0, 10, 0], [0, 0, 10]])
    faces = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]
    both = read(piece(corners, faces), piece(np.zeros((0, 3)), []), piece(corners + 50, faces))
    assert both.vertices_mm.tolist() == [*corners.tolist(), *(corners + 50).tolist()]
    assert len(both.triangles) == 8
    # Without the check this corner would be one of the piece behind it.
    with pytest.raises(endowire.InputError, match="a.vtp: piece 0: polygon 1 names vertex 3"):
        read(piece(corners[:3], faces), piece(corners + 50, faces))


def test_the_vessel_of_basic_wire_nav_is_read_from_its_files(tmp_path):
    made = endowire.Vessel.generate(
        np.array([[0, 0, 0, 1.2, -1], [0, 0, 6, 1.2, 0], [0, 0, 12, 1.2, 1], [4, 0, 16, 0.6, 2]]), edge_mm=0.4
    )
    for folder in ("Meshes", "Paths"):
        (tmp_path / folder).mkdir()
    vtp_file(tmp_path / "Meshes" / "0011_H_AO_H.vtp", made, "raw")
    for name, points in (
        ("aorta", [[0, 0, z] for z in np.arange(13.0, -1.0, -0.5)]),
        ("carotid", [[0.1 * k, 0, 12.0 + 0.1 * k] for k in range(38)]),
    ):
        places = "".join(f'<path_point><pos x="{x}" y="{y}" z="{z}" /></path_point>' for x, y, z in points)
        (tmp_path / "Paths" / f"{name}.pth").write_text(f"<path><path_points>{places}</path_points></path>")
    vessels = originals.basic_wire_nav(tmp_path)
    assert vessels.site.vessel.vertices_mm[:, 2].max() > 150.0
    assert vessels.site.sheath["direction"][2] > 0.0
    env = gymnasium.make("endowire/BasicWireNav-v0", data=tmp_path, observed="physical").unwrapped
    first, _ = env.reset(seed=1)
    assert first["target_mm"][2] > 120.0
    assert env.step(np.array([[0.9, 0.0]]))[4]["failure"] == ""
    (tmp_path / "Paths" / "aorta.pth").write_text("<path/>")
    with pytest.raises(endowire.InputError, match="aorta.pth: no path of SimVascular: it has 0 points"):
        originals.basic_wire_nav(tmp_path)
