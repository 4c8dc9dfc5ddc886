//! Objects: closed surfaces of the size they say, and mesh files that are meshes.

use std::collections::HashMap;
use std::f64::consts::PI;
use std::path::Path;

use geometry::TriangleMesh;
use geometry::nalgebra::{Point3, Vector3};
use sim::SimError;
use sim::objects::{KINDS_BY_CODE, Shape};

fn shape(yaml: &str) -> Shape {
    serde_yaml_ng::from_str(yaml).unwrap()
}

fn mesh(yaml: &str) -> TriangleMesh {
    shape(yaml).mesh(Path::new(".")).unwrap()
}

fn refusal(yaml: &str) -> String {
    shape(yaml).mesh(Path::new(".")).unwrap_err().to_string()
}

/// By the divergence theorem; positive where the normals of a closed surface point outwards.
fn volume(mesh: &TriangleMesh) -> f64 {
    let tetrahedra = (0..mesh.triangles.len()).map(|triangle| {
        let [a, b, c] = mesh.corners(triangle).map(|corner| corner.coords);
        a.dot(&b.cross(&c)) / 6.0
    });
    tetrahedra.sum()
}

fn extent(mesh: &TriangleMesh) -> (Point3<f64>, Vector3<f64>) {
    let first = mesh.vertices[0];
    let (least, most) = mesh.vertices.iter().fold((first, first), |(least, most), vertex| {
        (least.inf(vertex), most.sup(vertex))
    });
    (least, most - least)
}

/// Every edge is walked once in each direction.
fn assert_watertight(name: &str, mesh: &TriangleMesh) {
    let mut walked: HashMap<(u32, u32), u32> = HashMap::new();
    for &[a, b, c] in &mesh.triangles {
        for edge in [(a, b), (b, c), (c, a)] {
            *walked.entry(edge).or_default() += 1;
        }
    }
    for (&(from, to), &times) in &walked {
        assert_eq!(times, 1, "{name}: edge {from}-{to}");
        assert_eq!(walked.get(&(to, from)), Some(&1), "{name}: edge {to}-{from}");
    }
}

fn assert_near(what: &str, found: f64, expected: f64, tolerance: f64) {
    assert!(
        (found - expected).abs() <= tolerance,
        "{what} is {found}, expected {expected}"
    );
}

#[test]
fn every_kind_is_closed_faces_outwards_and_stands_on_the_table() {
    for kind in KINDS_BY_CODE {
        let mesh = mesh(kind);
        assert_watertight(kind, &mesh);
        let (least, size) = extent(&mesh);
        assert_near(kind, least.z, 0.0, 1e-12);
        assert!(volume(&mesh) > 1e-7, "{kind} has {} m3", volume(&mesh));
        assert!(
            size.iter().all(|side| (0.002..=0.2).contains(side)),
            "{kind} measures {size}"
        );
        for triangle in 0..mesh.triangles.len() {
            let [a, b, c] = mesh.corners(triangle);
            assert!(
                (b - a).cross(&(c - a)).norm() > 1e-12,
                "{kind}: triangle {triangle} is a line"
            );
        }
    }
}

#[test]
fn objects_measure_what_they_say() {
    let octagon_area = |width: f64| 2.0 * (2.0_f64.sqrt() - 1.0) * width * width;
    let frustum = |low: f64, high: f64, height: f64| height / 3.0 * (low + high + (low * high).sqrt());
    let a = [0.1, 0.076, 0.058, 0.034].map(octagon_area);
    let stepped = a[0] * 0.002 + frustum(a[0], a[1], 0.012) + frustum(a[2], a[3], 0.015);
    for (yaml, size, expected, tolerance) in [
        ("{kind: box, size: [0.03, 0.02, 0.01]}", [0.03, 0.02, 0.01], 6e-6, 1e-9),
        ("plate", [0.1, 0.1, 0.01], 1e-4, 1e-9),
        ("base_plate", [0.15, 0.15, 0.003], 6.75e-5, 1e-9),
        ("disc", [0.05, 0.05, 0.00315], PI * 0.025_f64.powi(2) * 0.00315, 1e-3),
        ("cylinder", [0.05, 0.05, 0.06], PI * 0.025_f64.powi(2) * 0.06, 1e-3),
        ("octagon1", [0.1, 0.1, 0.014], octagon_area(0.1) * 0.014, 1e-9),
        ("octagon2", [0.1, 0.1, 0.029], stepped, 1e-9),
        ("cross", [0.1, 0.1, 0.02], (2.0 * 0.1 * 0.03 - 0.03 * 0.03) * 0.02, 1e-9),
        (
            "bracket",
            [0.08, 0.08, 0.025],
            (0.08 * 0.08 - 0.055 * 0.055) * 0.025,
            1e-9,
        ),
        ("pyramid", [0.1, 0.1, 0.055], 0.01 * 0.055 / 3.0, 1e-9),
        ("wedge", [0.070_71, 0.1, 0.071_71], 0.070_71 * 0.1 * 0.036_355, 1e-9),
        (
            "hemisphere",
            [0.08, 0.08, 0.04],
            2.0 / 3.0 * PI * 0.04_f64.powi(3),
            2e-3,
        ),
        ("sphere", [0.06, 0.06, 0.06], 4.0 / 3.0 * PI * 0.03_f64.powi(3), 2e-3),
    ] {
        let mesh = mesh(yaml);
        let (_, found) = extent(&mesh);
        for (found, expected) in found.iter().zip(size) {
            assert_near(yaml, *found, expected, 1e-9);
        }
        assert_near(yaml, volume(&mesh) / expected, 1.0, tolerance);
    }
}

#[test]
fn curved_and_toothed_objects_have_their_volume() {
    // Pappus: section times the way of its middle; an inscribed polygon has a little less.
    let bar = volume(&mesh("bent_cylinder")) / (PI * 0.015_f64.powi(2) * 0.06 * 1.8);
    assert!((0.995..1.0).contains(&bar), "the bent cylinder has {bar} of its volume");
    let ring = |outer: f64| PI * (outer * outer - 0.016 * 0.016) / 4.0 * 0.015;
    let gear = volume(&mesh("gear"));
    assert!((ring(0.064)..ring(0.08)).contains(&gear), "the gear has {gear} m3");
    let star = volume(&mesh("star"));
    let triangles = 10.0 * 0.5 * 0.05 * 0.0225 * (PI / 5.0).sin() * 0.02;
    assert_near("the star's volume", star / triangles, 1.0, 1e-9);
    let relief = volume(&mesh("relief"));
    assert!((0.005..0.015).contains(&(relief / 0.01)), "the relief has {relief} m3");
    assert_ne!(
        mesh("relief"),
        mesh("{kind: relief, seed: 2}"),
        "another seed is another relief"
    );
}

#[test]
fn sizes_that_make_no_object_are_refused_with_what_is_allowed() {
    assert_eq!(
        refusal("{kind: pyramid, height: 0}"),
        "side and height is 0 m; allowed is 0.0001 to 1 m"
    );
    assert_eq!(
        refusal("{kind: sphere, radius: .nan}"),
        "radius is NaN m; allowed is 0.0001 to 1 m"
    );
    assert_eq!(
        refusal("{kind: gear, bore: 0.05}"),
        "bore is 0.05 m; allowed is less than half of root_diameter, which is 0.032 m"
    );
    assert_eq!(refusal("{kind: star, points: 2}"), "points is 2; allowed is 3 to 60");
    assert_eq!(
        refusal("{kind: bent_cylinder, angle: 7}"),
        "angle is 7 rad; allowed is more than 0 and less than 2 pi"
    );
    let unknown = serde_yaml_ng::from_str::<Shape>("{kind: sphere, diameter: 0.1}").unwrap_err();
    assert!(unknown.to_string().contains("unknown field `diameter`"), "{unknown}");
    let unknown = serde_yaml_ng::from_str::<Shape>("teapot").unwrap_err();
    assert!(
        unknown
            .to_string()
            .contains("unknown variant `teapot`, expected one of"),
        "{unknown}"
    );
}

fn read(folder: &Path, name: &str, content: &[u8]) -> Result<TriangleMesh, SimError> {
    std::fs::write(folder.join(name), content).unwrap();
    shape(&format!("{{kind: mesh, file: {name}, scale: 0.001}}")).mesh(folder)
}

const OBJ: &str = "v 0 0 0\nv 10 0 0\nv 0 20 0\nv 0 0 30\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n";

fn ply(format: &str, triangle: &str) -> String {
    format!(
        "ply\nformat {format} 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n\
         element face 4\nproperty list uchar int vertex_indices\nend_header\n\
         0 0 0\n10 0 0\n0 20 0\n0 0 30\n3 0 2 1\n3 0 1 3\n3 1 2 3\n{triangle}\n"
    )
}

#[test]
fn meshes_come_from_obj_and_ply_files_in_any_unit() {
    let folder = tempfile::tempdir().unwrap();
    for (name, content) in [("t.obj", OBJ.to_owned()), ("t.PLY", ply("ascii", "3 2 0 3"))] {
        let mesh = read(folder.path(), name, content.as_bytes()).unwrap();
        assert_watertight(name, &mesh);
        assert_near(name, volume(&mesh), 1e-6, 1e-13);
    }
    let mut binary = ply("binary_little_endian", "").into_bytes();
    binary.truncate(binary.windows(10).position(|part| part == b"end_header").unwrap() + 11);
    for number in [0.0, 0.0, 0.0, 10.0, 0.0, 0.0, 0.0, 20.0, 0.0, 0.0, 0.0, 30.0_f32] {
        binary.extend(number.to_le_bytes());
    }
    for face in [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3_i32]] {
        binary.push(3);
        binary.extend(face.iter().flat_map(|vertex| vertex.to_le_bytes()));
    }
    let mesh = read(folder.path(), "binary.ply", &binary).unwrap();
    assert_near("binary", volume(&mesh), 1e-6, 1e-13);
    binary.truncate(binary.len() - 3);
    assert!(read(folder.path(), "cut.ply", &binary).is_err(), "a file that was cut");
}

#[test]
fn files_that_are_no_meshes_are_refused_with_place_and_reason() {
    let folder = tempfile::tempdir().unwrap();
    for (name, content, expected) in [
        ("a.obj", "v 0 0 0\n".to_owned(), "the file: it has no triangles"),
        (
            "b.obj",
            OBJ.replace("v 10 0 0", "v NaN 0 0"),
            "the vertex at [NaN, 0.0, 0.0]: it is not finite",
        ),
        (
            "c.ply",
            ply("ascii", "3 2 0 4"),
            "triangle 3: it is [2, 0, 4], but there are 4 vertices",
        ),
        (
            "d.ply",
            ply("ascii", "3 2 0 -1"),
            "face 3: it has no list \"vertex_indices\" from 0 up",
        ),
        (
            "e.ply",
            ply("ascii", "3 2 0 3").replace("float z", "float w"),
            "vertex 0: it has no number \"z\"",
        ),
        (
            "f.stl",
            String::new(),
            "the file's name: it ends in neither .obj nor .ply",
        ),
        ("g.ply", "not a mesh".to_owned(), "the file: "),
        ("h.obj", OBJ.replace("f 3 1 4", "f 3 1 9"), "the file: "),
    ] {
        let error = read(folder.path(), name, content.as_bytes()).unwrap_err().to_string();
        assert!(error.contains(name) && error.contains(expected), "{error}");
    }
    let missing = shape("{kind: mesh, file: nowhere.obj}")
        .mesh(folder.path())
        .unwrap_err();
    assert!(matches!(missing, SimError::ReadFile { .. }), "{missing}");
}

#[test]
fn the_stepped_octagon_is_that_of_the_path_traced_captures() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data/rig/meshes");
    if !folder.exists() {
        println!("SKIPPED: {} is missing", folder.display());
        return;
    }
    for name in ["octagon2", "pyramid", "disc", "base_plate"] {
        let theirs = shape(&format!("{{kind: mesh, file: {name}.ply}}"))
            .mesh(&folder)
            .unwrap();
        let ours = mesh(name);
        assert_near(name, volume(&ours) / volume(&theirs), 1.0, 1e-3);
        assert_near(name, (extent(&ours).1 - extent(&theirs).1).norm(), 0.0, 1e-5);
    }
}
