//! Mesh files, whole and malformed.
#![allow(clippy::unwrap_used, clippy::panic)]

mod malformed;
#[path = "../signs/meshes.rs"]
mod meshes;
mod write;

use malformed::{HEAD, POINTS};
use meshes::{Dice, icosphere, torus};
use sdfrs_mesh::check::check;
use sdfrs_mesh::read::{Format, parse, read};
use sdfrs_mesh::{Mesh, MeshError};
use std::time::{Duration, Instant};
use write::{glb, glb_of, glb_parts, obj, off, ply_binary, ply_text, stl_binary, stl_text};

/// Every way to write `mesh`.
fn files(mesh: &Mesh) -> Vec<(&'static str, Format, Vec<u8>)> {
    vec![
        ("obj", Format::Obj, obj(mesh)),
        ("off", Format::Off, off(mesh)),
        ("stl text", Format::Stl, stl_text(mesh)),
        ("stl binary", Format::Stl, stl_binary(mesh)),
        ("ply text", Format::Ply, ply_text(mesh)),
        ("ply little", Format::Ply, ply_binary(mesh, true)),
        ("ply big", Format::Ply, ply_binary(mesh, false)),
        ("glb", Format::Glb, glb(mesh)),
    ]
}

/// The error's words; everything else is a failure.
fn refused(format: Format, bytes: &[u8]) -> String {
    match parse(format, bytes) {
        Err(error @ MeshError::Bad { .. }) => error.to_string(),
        other => panic!("{format:?}: {other:?} from {:?}", String::from_utf8_lossy(bytes)),
    }
}

#[test]
fn every_format_gives_the_mesh_back() {
    for mesh in [icosphere(2), torus(1.0, 0.4, 17, 9)] {
        for (name, format, bytes) in files(&mesh) {
            let got = parse(format, &bytes).unwrap();
            let f32s = matches!(name, "stl binary" | "glb");
            for (f, g) in mesh.faces.iter().zip(&got.faces) {
                for (&v, &w) in f.iter().zip(g) {
                    let p = mesh.vertices[v as usize];
                    let p = if f32s { p.map(|x| f64::from(x as f32)) } else { p };
                    assert_eq!(p, got.vertices[w as usize], "{name}");
                }
            }
            assert_eq!(mesh.faces.len(), got.faces.len(), "{name}");
            let (_, findings) = check(&got).unwrap();
            assert!(
                findings.closed() && findings.manifold && findings.components == 1,
                "{name}: {findings:?}"
            );
        }
    }
}

#[test]
fn obj_knows_its_older_forms() {
    let text = "\u{feff}v 0 0 0 1.0\nv 1 0 0 0.5 0.5 0.5\r\nv 1 1e0 0\nv 0 +1 -0.0\nf -4/1/1 -3 \\\n -2 -1 # a square\nl 1 2\ng x\n";
    let mesh = parse(Format::Obj, text.as_bytes()).unwrap();
    assert_eq!(mesh.faces, [[0, 1, 2], [0, 2, 3]]);
    // A face may come before its vertices.
    assert_eq!(parse(Format::Obj, b"f 1 2 3\nv 0 0 0\nv 1 0 0\nv 0 1 0").unwrap().faces, [[0, 1, 2]]);
}

#[test]
fn off_passes_over_colours_and_takes_its_numbers_anywhere() {
    let mesh =
        parse(Format::Off, b"COFF 3 1 0\n0 0 0 1 0 0 1\n1 0 0 0 1 0 1\n0 1 0 0 0 1 1\n3 0 1 2 0.5 0.5 0.5")
            .unwrap();
    assert_eq!((mesh.vertices.len(), mesh.faces), (3, vec![[0, 1, 2]]));
    let mesh = parse(Format::Off, b"OFF 4 1 0 # counts\n0 0 0 1 0 0\n1 1 0\n0\n1 0\n4 0 1 2\n3").unwrap();
    assert_eq!(mesh.faces, [[0, 1, 2], [0, 2, 3]]);
}

/// The area of a polygon's triangles, and of each on its own, in the xy plane.
fn areas(mesh: &Mesh) -> Vec<f64> {
    let at = |v: u32| mesh.vertices[v as usize];
    let area =
        |[a, b, c]: [[f64; 3]; 3]| ((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])) / 2.0;
    mesh.faces.iter().map(|f| area(f.map(at))).collect()
}

#[test]
fn polygons_are_cut_into_triangles_that_cover_them() {
    // A comb: concave, with corners on straight sides.
    let comb = [
        (0, 0),
        (2, 0),
        (4, 0),
        (8, 0),
        (8, 4),
        (7, 1),
        (6, 4),
        (5, 1),
        (4, 4),
        (3, 1),
        (2, 4),
        (1, 1),
        (0, 4),
        (0, 2),
    ];
    let mut dice = Dice::new(3);
    let mut star: Vec<(f64, f64)> = (0..300)
        .map(|i| {
            let (angle, r) = (f64::from(i) * std::f64::consts::TAU / 300.0, 1.0 + 4.0 * dice.unit());
            (r * angle.cos(), r * angle.sin())
        })
        .collect();
    let comb: Vec<(f64, f64)> = comb.iter().map(|&(x, y)| (f64::from(x), f64::from(y))).collect();
    for (turn, shape) in [comb.clone(), star.clone(), {
        star.reverse();
        star
    }]
    .iter()
    .enumerate()
    {
        let mut text = String::new();
        for (x, y) in shape {
            text += &format!("v {x} {y} 0\n");
        }
        let corners: Vec<String> = (1..=shape.len()).map(|i| i.to_string()).collect();
        let mesh = parse(Format::Obj, format!("{text}f {}", corners.join(" ")).as_bytes()).unwrap();
        let whole: f64 = (0..shape.len())
            .map(|i| {
                let ((a, b), (c, d)) = (shape[i], shape[(i + 1) % shape.len()]);
                (a * d - b * c) / 2.0
            })
            .sum();
        let areas = areas(&mesh);
        assert_eq!(areas.len(), shape.len() - 2);
        assert!((areas.iter().sum::<f64>() - whole).abs() < 1e-9, "{turn}");
        assert!(areas.iter().all(|a| a * whole > 0.0), "{turn}: none is flat or turned round");
        let f = check(&mesh).unwrap().1;
        assert_eq!((f.boundary_edges, f.components, f.oriented), (shape.len() as u64, 1, true));
    }
}

#[test]
fn glb_nodes_move_their_meshes() {
    let tetrahedron = Mesh {
        vertices: vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
        faces: vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]],
    };
    let nodes =
        r#"{"children":[1,2],"translation":[10,0,0]},{"mesh":0,"scale":[2,2,2]},{"mesh":0,"scale":[-1,1,1]}"#;
    let (json, chunk) = glb_parts(&tetrahedron, nodes);
    let (_, f) = check(&parse(Format::Glb, &glb_of(&json, &chunk)).unwrap()).unwrap();
    assert_eq!((f.faces, f.components), (8, 1), "they touch at a corner");
    assert_eq!(f.bounds, ([9.0, 0.0, 0.0], [12.0, 2.0, 2.0]));
    assert!(
        (f.signed_volume - 9.0 / 6.0).abs() < 1e-12,
        "the mirrored one isn't inside out: {}",
        f.signed_volume
    );

    let cycle = glb_parts(&tetrahedron, r#"{"mesh":0,"children":[1]},{"children":[0]}"#);
    assert!(refused(Format::Glb, &glb_of(&cycle.0, &cycle.1)).contains("node 0"));
}

/// One change to a file, of the kinds that happen and the kinds that are meant.
fn mutate(bytes: &[u8], dice: &mut Dice) -> Vec<u8> {
    let mut bytes = bytes.to_vec();
    let at = dice.below(bytes.len());
    let span = (1 + dice.below(12)).min(bytes.len() - at);
    let evil: [&[u8]; 12] = [
        b"-1",
        b"0",
        b"nan",
        b"inf",
        b"4294967296",
        b"99999999999999999999",
        b"\0",
        b"\xff\xff\xff\xff",
        b"\n",
        b" ",
        b"{",
        b"1e400",
    ];
    match dice.below(6) {
        0 => bytes.truncate(at),
        1 => bytes[at] ^= 1 << dice.below(8),
        2 => bytes[at..at + span].iter_mut().for_each(|b| *b = dice.bits() as u8),
        3 => drop(bytes.drain(at..at + span)),
        4 => {
            let again = bytes[at..at + span].to_vec();
            bytes.splice(at..at, again);
        }
        _ => drop(bytes.splice(at..at + span.min(3), evil[dice.below(evil.len())].iter().copied())),
    }
    bytes
}

#[test]
fn no_mutation_of_a_file_breaks_a_reader() {
    let mut dice = Dice::new(17);
    let before = virtual_peak();
    for (name, format, bytes) in files(&icosphere(0)) {
        let mut refusals = 0;
        for round in 0..4000 {
            let mut bad = mutate(&bytes, &mut dice);
            for _ in 0..round % 3 {
                bad = if bad.is_empty() { bad } else { mutate(&bad, &mut dice) };
            }
            let began = Instant::now();
            match parse(format, &bad) {
                // What is read is believed by nobody before it is checked.
                Ok(mesh) => drop(check(&mesh)),
                Err(MeshError::Bad { element, message }) => {
                    assert!(!element.is_empty() && message.len() < 600, "{name}: {element}: {message}");
                    refusals += 1;
                }
                Err(other) => panic!("{name}: {other}"),
            }
            assert!(began.elapsed() < Duration::from_millis(500), "{name}: {:?}", began.elapsed());
        }
        assert!(refusals > 40, "{name}: only {refusals} mutations were refused");
    }
    if let (Some(before), Some(after)) = (before, virtual_peak()) {
        assert!(after < before + (256 << 20), "{before} bytes of address space before, {after} after");
    }
}

#[test]
fn claims_beyond_the_file_cost_nothing() {
    let stl = [vec![0_u8; 80], (1_u32 << 31).to_le_bytes().to_vec(), vec![0; 44]].concat();
    let ply = format!("{HEAD}element face 2147483648\nproperty list uint int vertex_indices\n{POINTS}");
    let none =
        "ply\nformat binary_little_endian 1.0\nelement nothing 9000000000000000000\nend_header\n".to_owned();
    let long = "ply\n".to_owned() + &"x".repeat(1 << 20);
    let files = [
        (Format::Stl, stl),
        (Format::Ply, ply.into_bytes()),
        (Format::Ply, none.into_bytes()),
        (Format::Ply, long.into_bytes()),
        (Format::Off, b"OFF 3 2147483648 0\n".to_vec()),
    ];
    for (format, bytes) in files {
        let quickest = (0..5).map(|_| {
            let began = Instant::now();
            refused(format, &bytes);
            began.elapsed()
        });
        let quickest = quickest.min().unwrap();
        assert!(quickest < Duration::from_millis(10), "{format:?}: {quickest:?}");
    }
}

/// The most address space that this process has had.
fn virtual_peak() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|line| line.starts_with("VmPeak"))?;
    Some(line.split_whitespace().nth(1)?.parse::<u64>().ok()? << 10)
}

#[test]
fn errors_name_the_file() {
    let folder = std::env::temp_dir().join(format!("sdfrs-read-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let path = folder.join("Ball.OFF");
    std::fs::write(&path, off(&icosphere(1))).unwrap();
    assert_eq!(read(&path).unwrap().faces.len(), 80);
    std::fs::write(&path, "OFF\n1 1 0\n0 nan 0\n3 0 0 0\n").unwrap();
    let message = read(&path).unwrap_err().to_string();
    assert!(message.contains("Ball.OFF: line 3, vertex 0: y is NaN"), "{message}");
    for (name, word) in
        [("none.obj", "cannot be opened"), ("a.gltf", "one .glb"), ("a.fbx", "known are"), ("", "known are")]
    {
        let message = read(folder.join(name)).unwrap_err().to_string();
        assert!(message.contains(word), "{message}");
    }
    std::fs::create_dir_all(folder.join("folder.ply")).unwrap();
    assert!(read(folder.join("folder.ply")).unwrap_err().to_string().contains("not a file"));
    std::fs::remove_dir_all(&folder).unwrap();
}
