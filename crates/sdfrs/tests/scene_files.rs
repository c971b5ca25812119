//! Scene files: what is written reads back bit for bit, and whatever is wrong is refused with its path.
#![allow(clippy::expect_used, clippy::unwrap_used)] // a test's helpers fail with the reason

use sdfrs::{Camera, PointLight, SceneFile, Shape, Value, camera::Kind};

const CAMERA: &str = r#"{"kind": "pinhole", "origin": [0, 0, 5], "target": [0, 0, 0], "up": [0, 1, 0],
    "fov": 40, "width": 64, "height": 48}"#;

fn sphere() -> Shape {
    Shape::build("sphere", vec![("radius".into(), Value::Num(0.1 + 0.2))], vec![]).unwrap()
}

/// A file with some more keys after the nodes.
fn file(nodes: &str, more: &str) -> String {
    format!("{{\"sdfrs\": 1, \"nodes\": [{nodes}], \"root\": 0{more}}}")
}

fn fails(text: &str, path: &str, word: &str) {
    let error = SceneFile::parse(text).map(|_| "it was read").expect_err(text);
    assert!(error.path == path && error.message.contains(word), "{text}\ngave {error}");
}

fn with(more: &str) -> String {
    file(r#"{"op": "sphere", "radius": 1}"#, more)
}

#[test]
fn a_full_scene_reads_back_bit_for_bit() {
    let mut scene = SceneFile::new(sphere());
    scene.camera = Some(Camera {
        kind: Kind::Pinhole { fov_deg: 40.0 / 3.0 },
        origin: [0.1 + 0.2, -0.0, 5e-324],
        target: [1e300, 1.0 / 3.0, -2.0],
        up: [0.0, 1.0, 1e-17],
        width: 65536,
        height: 1,
    });
    let lamp = PointLight { position: [1.0 / 3.0, 2.0, 3.0], color: [0.1, 0.7, 1e9], intensity: 0.0 };
    scene.lights = Some(vec![lamp, PointLight::at([0.0; 3])]);
    scene.background = Some([0.1, 0.2, 0.3]);
    scene.albedo = Some([1.0, 0.0, 1.0 / 3.0]);
    let text = scene.to_json_string();
    let back = SceneFile::parse(&text).unwrap();
    assert_eq!(back.to_json_string(), text);
    assert_eq!((back.camera, &back.lights), (scene.camera, &scene.lights));
    assert_eq!((back.background, back.albedo), (scene.background, scene.albedo));
    assert_eq!(back.shape.args(), scene.shape.args());
}

#[test]
fn what_is_left_out_stays_out() {
    let text = SceneFile::new(sphere()).to_json_string();
    let back = SceneFile::parse(&text).unwrap();
    assert!(
        back.camera.is_none() && back.lights.is_none() && back.background.is_none() && back.albedo.is_none()
    );
    assert_eq!(back.to_json_string(), text);
    let empty = SceneFile::parse(&with(r#", "lights": []"#)).unwrap();
    assert_eq!(empty.lights, Some(vec![]));
    let light = SceneFile::parse(&with(r#", "lights": [{"position": [1, 2, 3]}]"#)).unwrap();
    assert_eq!(light.lights, Some(vec![PointLight::at([1.0, 2.0, 3.0])]));
}

#[test]
fn orthographic_cameras_read_back() {
    let ortho = CAMERA.replace("pinhole", "orthographic").replace("fov", "extent");
    let scene = SceneFile::parse(&with(&format!(", \"camera\": {ortho}"))).unwrap();
    assert_eq!(scene.camera.unwrap().kind, Kind::Orthographic { extent: 40.0 });
    assert_eq!(SceneFile::parse(&scene.to_json_string()).unwrap().camera, scene.camera);
}

#[test]
fn a_chain_of_a_hundred_thousand_saves_and_loads() {
    let mut shape = sphere();
    for i in 0..100_000 {
        let offset = ("offset".into(), Value::Vec3([f64::from(i % 7) * 1e-6, 0.0, 0.0]));
        shape = Shape::build("translate", vec![offset], vec![shape]).unwrap();
    }
    let text = SceneFile::new(shape).to_json_string();
    assert_eq!(SceneFile::parse(&text).unwrap().to_json_string(), text);
}

#[test]
fn refuses_what_is_no_scene() {
    let good = with("");
    assert!(SceneFile::parse(&good).is_ok());
    fails("[]", "file", "object");
    fails("{}", "sdfrs", "missing");
    for version in ["2", "0", "\"1\"", "1.0", "null", "true"] {
        fails(&good.replacen("1", version, 1), "sdfrs", "allowed: 1");
    }
    fails(&good.replace("\"nodes\"", "\"shapes\""), "nodes", "missing");
    fails(&good.replace("\"root\": 0", "\"root\": 1"), "root", "allowed: 0 to 0");
    for root in ["-1", "0.0", "null", "\"0\""] {
        fails(&good.replace("\"root\": 0", &format!("\"root\": {root}")), "root", "whole number");
    }
    fails(&file("", ""), "nodes", "got 0");
    fails(&file(r#"{"op": "x"}"#, ""), "root", "expression");
    fails(&file(r#"{"op": "negate", "of": [0]}"#, ""), "nodes[0].of[0]", "first node");
    fails(
        &file(r#"{"op": "negate", "of": [1]}, {"op": "sphere", "radius": 1}"#, ""),
        "nodes[0].of[0]",
        "got 1",
    );
    fails(&good.replace("[{", "{").replace("}]", "}"), "nodes", "list");
    fails(&with(r#", "sdfrs": 1"#), "sdfrs", "twice");
    fails(&with(r#", "colour": 1"#), "colour", "unknown key");
    fails(&with(r#", "background": [0, 0]"#), "background", "three numbers");
    fails(&with(r#", "background": [0, 0, 2]"#), "background", "from 0 to 1");
    fails(&with(r#", "albedo": [0, 0, -1]"#), "albedo", "from 0 to 1");
    fails(&with(r#", "albedo": null"#), "albedo", "null");
}

#[test]
fn refuses_bad_cameras() {
    let camera = |from: &str, to: &str| with(&format!(", \"camera\": {}", CAMERA.replacen(from, to, 1)));
    fails(&camera("pinhole", "fisheye"), "camera.kind", "orthographic");
    fails(&camera("\"fov\": 40", "\"fov\": 180"), "camera.fov", "180");
    fails(&camera("\"fov\": 40", "\"fov\": \"wide\""), "camera.fov", "number");
    fails(&camera("\"fov\": 40", "\"extent\": 40"), "camera.fov", "missing");
    fails(&camera("\"fov\"", "\"extent\": 1, \"fov\""), "camera.extent", "unknown key");
    fails(&camera("[0, 0, 5]", "[0, 0, 0]"), "camera.target", "apart");
    fails(&camera("[0, 1, 0]", "[0, 0, 1]"), "camera.up", "parallel");
    fails(&camera("[0, 1, 0]", "[0, 1, 1e999]"), "camera.up[2]", "out of range");
    fails(&camera("64", "0"), "camera", "allowed: 1 to 65536");
    fails(&camera("64", "65537"), "camera", "allowed: 1 to 65536");
    fails(&camera("64", "99999999999"), "camera.width", "whole number");
    fails(&camera("64", "64.0"), "camera.width", "whole number");
    fails(&camera("\"up\"", "\"down\""), "camera.up", "missing");
    fails(&with(", \"camera\": []"), "camera", "object");
}

#[test]
fn refuses_bad_lights() {
    let light = |text: &str| with(&format!(", \"lights\": [{{\"position\": [0, 0, 0]}}, {text}]"));
    fails(&light("{}"), "lights[1].position", "missing");
    fails(&light("3"), "lights[1]", "object");
    fails(&light(r#"{"position": [0, 0]}"#), "lights[1].position", "three numbers");
    fails(&light(r#"{"position": [0, 0, 0], "intensity": -1}"#), "lights[1].intensity", "-1");
    fails(&light(r#"{"position": [0, 0, 0], "color": [0, 0, -1]}"#), "lights[1].color", "-1");
    fails(&light(r#"{"position": [0, 0, 0], "radius": 1}"#), "lights[1].radius", "unknown key");
    fails(&light(r#"{"position": [0, 0, 0], "color": [0, NaN, 1]}"#), "lights[1].color[1]", "line");
    let many = vec![r#"{"position": [0, 0, 0]}"#; 1025].join(",");
    fails(&with(&format!(", \"lights\": [{many}]")), "lights", "1025");
}

#[test]
fn refuses_texts_that_are_cut_off_or_too_deep() {
    let mut scene = SceneFile::new(sphere());
    scene.background = Some([0.5; 3]);
    let text = scene.to_json_string();
    for (end, _) in text.trim_end().char_indices() {
        assert!(SceneFile::parse(&text[..end]).is_err(), "{}", &text[..end]);
    }
    let deep = format!("{}{}", "[".repeat(200), "]".repeat(200));
    let error = SceneFile::parse(&file(&deep, "")).map(|_| ()).expect_err("too deep");
    assert!(error.path.starts_with("nodes[0][0]") && error.message.contains("recursion"), "{error}");
}
