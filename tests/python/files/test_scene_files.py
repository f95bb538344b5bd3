"""GLB, GLTF and 3MF: triangles stand where the scene puts them, and claims of a file are not believed."""

import contextlib
import io
import json
import time
import zipfile

import numpy as np
import pytest

import graspforce as gf
from graspforce.files import load_mesh
from graspforce.surfaces import MeshSurface

trimesh = pytest.importorskip("trimesh", reason="trimesh is not installed: pip install 'graspforce[mesh]'")
KINDS = ["glb", "gltf", "3mf"]


def needs(kind):
    if kind == "3mf":
        pytest.importorskip("lxml")
        pytest.importorskip("networkx")


def saved(folder, kind):
    """Write a ball twice, once moved; return the path and what is written."""
    ball = trimesh.creation.icosphere(subdivisions=1, radius=0.05)
    scene = trimesh.Scene()
    scene.add_geometry(ball, geom_name="ball")
    scene.add_geometry(
        ball, geom_name="ball", transform=trimesh.transformations.translation_matrix([0.2, 0, 0])
    )
    path = folder / f"two.{kind}"
    made = scene.export(file_type=kind)
    if isinstance(made, dict):
        for name, content in made.items():
            (folder / name).write_bytes(content)
        (folder / "model.gltf").rename(path)
    else:
        path.write_bytes(made)
    return path, np.concatenate([ball.triangles, np.add(ball.triangles, [0.2, 0, 0])])


def in_order(triangles):
    rows = np.round(triangles.reshape(-1, 9), 6)
    return rows[np.lexsort(rows.T)]


@pytest.mark.parametrize("kind", KINDS)
def test_the_meshes_of_a_scene_stand_where_it_puts_them(tmp_path, kind):
    needs(kind)
    path, triangles = saved(tmp_path, kind)
    vertices, faces = load_mesh(path)
    np.testing.assert_allclose(in_order(vertices[faces]), in_order(triangles), atol=2e-6)
    assert len(MeshSurface(path).faces) == len(triangles)


def test_the_meshes_of_xaml_stand_where_it_puts_them(tmp_path):
    needs("3mf")
    ball = trimesh.creation.icosphere(subdivisions=1, radius=0.05)
    text = {
        name: " ".join(map(str, getattr(ball, name).ravel()))
        for name in ("vertices", "vertex_normals", "faces")
    }
    path = tmp_path / "ball.xaml"
    path.write_text(
        '<ModelVisual3D xmlns="http://schemas.microsoft.com/winfx/2006/xaml/presentation">'
        '<ModelVisual3D.Transform><MatrixTransform3D Matrix="1 0 0 0 0 1 0 0 0 0 1 0 0.2 0 0 1"/>'
        "</ModelVisual3D.Transform><GeometryModel3D><MeshGeometry3D "
        f'Positions="{text["vertices"]}" Normals="{text["vertex_normals"]}" '
        f'TriangleIndices="{text["faces"]}"/>'
        "</GeometryModel3D></ModelVisual3D>"
    )
    vertices, faces = load_mesh(path)
    np.testing.assert_allclose(
        in_order(vertices[faces]), in_order(np.add(ball.triangles, [0.2, 0, 0])), atol=2e-6
    )


@pytest.mark.parametrize("kind", KINDS)
def test_a_mangled_scene_is_read_or_refused(tmp_path, kind):
    needs(kind)
    path, _ = saved(tmp_path, kind)
    content = path.read_bytes()
    random = np.random.default_rng(1)
    for _ in range(40):
        mangled = bytearray(content[: int(random.integers(1, len(content) + 1))])
        for at in random.integers(0, len(mangled), size=3):
            mangled[at] = int(random.integers(256))
        path.write_bytes(mangled)
        with contextlib.suppress(gf.InvalidFileError):
            vertices, faces = load_mesh(path)
            assert np.isfinite(vertices).all()
            assert faces.max() < len(vertices)


def refused_at_once(path, match):
    for read in (load_mesh, MeshSurface):
        begin = time.process_time()
        with pytest.raises(gf.InvalidFileError, match=match):
            read(path)
        assert time.process_time() - begin < 2.0


def gltf(path, change):
    header = json.loads(path.read_text())
    change(header)
    path.write_text(json.dumps(header))


def test_numbers_that_a_scene_does_not_hold_are_refused(tmp_path):
    path, _ = saved(tmp_path, "gltf")
    gltf(path, lambda h: h["accessors"].append({"type": "MAT4", "componentType": 5126, "count": 10**12}))
    refused_at_once(path, "claims")


def test_files_that_a_scene_names_lie_beside_it(tmp_path):
    (tmp_path / "in").mkdir()
    path, _ = saved(tmp_path / "in", "gltf")
    (tmp_path / "secret.bin").write_bytes(bytes(100_000))
    for name in ("../secret.bin", "%2e%2e/secret.bin", str(tmp_path / "secret.bin"), "missing.bin"):
        gltf(path, lambda h, name=name: h["buffers"][0].update(uri=name))
        refused_at_once(path, "outside|No such file|not the name")


def test_a_scene_that_repeats_its_meshes_without_bound_is_refused(tmp_path):
    path, _ = saved(tmp_path, "gltf")

    def crowd(header):
        mesh = next(node["mesh"] for node in header["nodes"] if "mesh" in node)
        first = len(header["nodes"])
        header["nodes"] += [{"mesh": mesh, "name": f"n{k}"} for k in range(100)]
        header["scenes"][0]["nodes"] += range(first, first + 100)

    gltf(path, crowd)
    assert len(load_mesh(path)[1]) == 102 * 80


@pytest.mark.parametrize(("parts", "count", "match"), [(20_000, 3, "parts"), (5_000, 50_000, "vertices")])
def test_parts_that_share_their_numbers_without_bound_are_refused(tmp_path, parts, count, match):
    path, _ = saved(tmp_path, "gltf")

    def repeat(header):
        header["accessors"].append({"type": "SCALAR", "componentType": 5125, "count": count})
        indices = len(header["accessors"]) - 1
        header["meshes"][0]["primitives"] = [{"attributes": {"POSITION": 0}, "indices": indices}] * parts

    gltf(path, repeat)
    path.write_text(path.read_text() + " " * count)
    refused_at_once(path, match)


def model_3mf(path, objects, items=("1",)):
    text = '<model unit="meter" xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02"><resources>'
    text += "".join(objects) + "</resources><build>"
    text += "".join(f'<item objectid="{item}"/>' for item in items) + "</build></model>"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("3D/3dmodel.model", text)


def test_objects_within_objects_that_multiply_are_refused(tmp_path):
    needs("3mf")
    path = tmp_path / "nest.3mf"
    twice = [
        f'<object id="{k}"><components><component objectid="{k + 1}"/><component objectid="{k + 1}"/>'
        "</components></object>"
        for k in range(1, 60)
    ]
    model_3mf(path, twice)
    refused_at_once(path, "places")
    model_3mf(path, ['<object id="1"><components><component objectid="1"/></components></object>'])
    refused_at_once(path, "deep")


def test_an_archive_that_unpacks_without_bound_is_refused(tmp_path):
    needs("3mf")
    content = io.BytesIO()
    with (
        zipfile.ZipFile(content, "w", zipfile.ZIP_DEFLATED) as archive,
        archive.open("3D/3dmodel.model", "w") as member,
    ):
        for _ in range(300):
            member.write(bytes(1024 * 1024))
    path = tmp_path / "bomb.3mf"
    path.write_bytes(content.getvalue())
    refused_at_once(path, "unpacked")


def test_a_path_is_a_mesh_and_what_cannot_be_read_is_named(tmp_path):
    ball = trimesh.creation.icosphere(subdivisions=2, radius=50)
    ball.export(tmp_path / "ball.stl")
    surface = MeshSurface(str(tmp_path / "ball.stl"), unit="mm")
    assert surface.length_scale == pytest.approx(0.05)
    assert MeshSurface.load(tmp_path / "ball.stl", unit="mm").bounds.tolist() == surface.bounds.tolist()
    (tmp_path / "a.step").write_text("")
    for name, message in (
        ("missing.stl", r"missing\.stl: No such file"),
        ("a.step", "'step' cannot be read; these can: obj.*stl.*glb"),
        ("", "directory"),
        ("ball.stl", r"unit: the mesh would be 100 m .*ball\.stl"),
    ):
        with pytest.raises(gf.InvalidInputError, match=message):
            MeshSurface(tmp_path / name)


def test_contacts_on_a_mesh_need_no_arranging():
    ball = trimesh.creation.icosphere(subdivisions=2, radius=0.05)
    options = {"starts": 3, "best": 1, "seed": 4}
    found = gf.plan_multistart(ball, contacts=3, **options)
    surface = MeshSurface(ball)
    same = gf.plan_multistart(
        gf.surfaces.contacts_on(*[surface] * 3),
        np.tile(surface.bounds, (3, 1)),
        0.02,
        0.002,
        min_distance=0.005,
        length_scale=surface.length_scale,
        origin=surface.center,
        **options,
    )
    assert found.best.quality.epsilon == pytest.approx(same.best.quality.epsilon, rel=1e-9)
    rough = gf.plan_multistart(surface, step=0.05, tolerance=0.04, contacts=2, friction=0.9, **options)
    assert rough.best.grasp.friction.tolist() == [0.9, 0.9]
    with pytest.raises(gf.InvalidInputError, match="contacts"):
        gf.plan_multistart(gf.surfaces.contacts_on(surface), contacts=2)
    with pytest.raises(gf.InvalidInputError, match="bounds: missing"):
        gf.plan_multistart(gf.surfaces.contacts_on(surface))
