//! Files that claim what they don't hold: each is refused, and the error names the place.

use super::*;

pub const HEAD: &str =
    "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n";
pub const POINTS: &str = "end_header\n0 0 0\n1 0 0\n0 1 0\n";

/// Malformed text files, and what the error has to say.
fn texts() -> Vec<(Format, String, &'static str)> {
    let faces = "element face 1\nproperty list uchar int vertex_indices\n";
    let ply = |head: &str, rest: &str| format!("{HEAD}{head}{POINTS}{rest}");
    let tri = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
    let three = "0 0 0\n1 0 0\n0 1 0\n";
    let obj = |rest: &str| format!("{tri}{rest}");
    let off = |counts: &str, rest: &str| format!("OFF\n{counts}\n{three}{rest}");
    let facet = "solid\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\n";
    let all = [
        (Format::Obj, String::new(), "no vertex"),
        (Format::Obj, "garbage\nmore".to_owned(), "no vertex"),
        (Format::Obj, tri.to_owned(), "no faces"),
        (Format::Obj, obj("f 1 2 4\n"), "line 4"),
        (Format::Obj, obj("f 0 1 2\n"), "line 4: a face has vertex '0'"),
        (Format::Obj, obj("f 1 2 -4\n"), "line 4"),
        (Format::Obj, obj("f 1 2 99999999999\n"), "line 4"),
        (Format::Obj, obj("f 1 2 99999999999999999999999\n"), "line 4"),
        (Format::Obj, obj("f 1 2 -9223372036854775808\n"), "line 4"),
        (Format::Obj, obj("f 1 2 x\n"), "line 4"),
        (Format::Obj, obj("f 1 2 /\n"), "line 4"),
        (Format::Obj, obj("f 1 2\n"), "2 corners"),
        (Format::Obj, obj("f\n"), "0 corners"),
        (Format::Obj, obj("v 1 2\nf 1 2 3\n"), "line 4: z is missing"),
        (Format::Obj, obj("v 1 nan 3\nf 1 2 3\n"), "line 4: y is NaN"),
        (Format::Obj, obj("v 1 2 1e999\nf 1 2 3\n"), "line 4: z is inf"),
        (Format::Obj, obj("v 1 2 0x3\nf 1 2 3\n"), "'0x3'"),
        (Format::Off, String::new(), "instead of OFF"),
        (Format::Off, "PNG".to_owned(), "instead of OFF"),
        (Format::Off, "OFF".to_owned(), "number of vertices is missing"),
        (Format::Off, "OFF BINARY\n".to_owned(), "binary OFF"),
        (Format::Off, "4OFF\n".to_owned(), "instead of OFF"),
        (Format::Off, off("3 -1 0", ""), "faces is -1"),
        (Format::Off, off("3 2147483648 0", "3 0 1 2\n"), "claims 3 vertices and 2147483648 faces"),
        (Format::Off, off("18446744073709551615 1 0", ""), "line 2"),
        (Format::Off, off("9223372036854775807 9223372036854775807 0", ""), "claims"),
        (Format::Off, off("3 1 0", "3 0 1 3\n"), "line 6, face 0: has vertex 3"),
        (Format::Off, off("3 1 0", "3 0 1 -2\n"), "face 0"),
        (Format::Off, off("3 1 0", "3 0 1"), "face 0: a corner is missing"),
        (Format::Off, off("3 1 0", "1000000000000 0 1"), "missing"),
        (Format::Off, off("3 1 0", "2 0 1       "), "2 corners"),
        (Format::Off, off("3 0 0", ""), "no faces"),
        (
            Format::Off,
            "OFF\n3 1 0\n0 0 0\n1 inf 0\n0 1 0\n3 0 1 2\n".to_owned(),
            "line 4, vertex 1: y is inf",
        ),
        (Format::Off, "OFF\n3 1 0\n0 0 0\n1 ? 0\n0 1 0\n3 0 1 2\n".to_owned(), "line 4, vertex 1: y is '?'"),
        (Format::Stl, "solid\nendsolid\n".to_owned(), "no faces"),
        (Format::Stl, "sol".to_owned(), "neither"),
        (Format::Stl, facet.to_owned(), "ends in a facet with 1 of 3"),
        (Format::Stl, format!("{facet}vertex 1 0 0\nendloop\nendfacet\n"), "line 7"),
        (Format::Stl, format!("{facet}vertex 1 0\n"), "line 5: z is missing"),
        (Format::Stl, format!("{facet}vertex 1 0 nan\n"), "line 5: z is NaN"),
        (Format::Stl, format!("{facet}facet normal 0 0 1\n"), "line 5"),
        (Format::Stl, format!("{facet}vertex 1 0 0\nvertex 0 1 0\nvertex 0 1 1\n"), "line 7"),
        (Format::Stl, "solid\nvertex 0 0 0\n".to_owned(), "line 2"),
        (Format::Stl, "solid\nwhat is this\n".to_owned(), "'what' outside"),
        (Format::Ply, String::new(), "line 1"),
        (Format::Ply, "plx\n".to_owned(), "line 1"),
        (Format::Ply, "ply\n".to_owned(), "end_header"),
        (Format::Ply, "ply\nformat ascii 1.0\nend_header\n".to_owned(), "no faces"),
        (Format::Ply, "ply\nend_header\n".to_owned(), "header"),
        (Format::Ply, "ply\nformat rot13 1.0\nend_header\n".to_owned(), "header"),
        (Format::Ply, ply("", ""), "no faces"),
        (Format::Ply, ply("property float w\nproperty\n", ""), "header"),
        (
            Format::Ply,
            ply("element face 2147483648\nproperty list uchar int vertex_indices\n", "3 0 1 2\n"),
            "element face",
        ),
        (
            Format::Ply,
            ply("element face 99999999999999999999\nproperty list uchar int vertex_indices\n", ""),
            "header",
        ),
        (Format::Ply, ply("element face -1\nproperty list uchar int vertex_indices\n", ""), "header"),
        (
            Format::Ply,
            ply("element face 1\nproperty list uchar float vertex_indices\n", "3 0 1 2\n"),
            "whole numbers",
        ),
        (Format::Ply, ply("element face 1\nproperty int vertex_indices\n", "3 0 1 2\n"), "no list"),
        (Format::Ply, ply("element face 1\nproperty list uchar int corners\n", "3 0 1 2\n"), "no list"),
        (Format::Ply, ply(faces, ""), "room"),
        (Format::Ply, ply(faces, "3 0 1\n"), "face"),
        (Format::Ply, ply(faces, "3 0 1 3\n"), "face 0"),
        (Format::Ply, ply(faces, "3 0 1 -1\n"), "face 0"),
        (Format::Ply, ply(faces, "2 0 1 2\n"), "face"),
        (Format::Ply, ply(faces, "300 0 1 2\n"), "face"),
        (Format::Ply, format!("{HEAD}{faces}end_header\n0 0 0\n1 nan 0\n0 1 0\n3 0 1 2\n"), "vertex"),
        (Format::Ply, format!("{HEAD}{faces}end_header\n0 0 0\n1e99 0 0\n0 1 0\n3 0 1 2\n"), "vertex 1"),
        (Format::Ply, HEAD.replace("float z", "list uchar float z") + faces + POINTS + three, "z is a list"),
        (Format::Ply, HEAD.replace("float z", "float w") + faces + POINTS + three, "no property z"),
    ];
    all.into()
}

#[test]
fn a_malformed_text_file_is_refused_by_its_line() {
    for (format, text, word) in texts() {
        let message = refused(format, text.as_bytes());
        assert!(message.contains(word), "{format:?} {text:?}: '{message}' doesn't say '{word}'");
    }
}

#[test]
fn a_malformed_binary_file_is_refused_by_its_element() {
    let ball = icosphere(0);
    let mut huge = stl_binary(&ball);
    huge[80..84].copy_from_slice(&u32::MAX.to_le_bytes());
    assert!(refused(Format::Stl, &huge[..128]).contains("byte 80: claims 4294967295 faces"));
    let mut nan = stl_binary(&ball);
    nan[84 + 50 * 3 + 20..][..4].copy_from_slice(&f32::NAN.to_le_bytes());
    assert!(refused(Format::Stl, &nan).contains("byte 234, face 3"));

    for little in [true, false] {
        let whole = ply_binary(&ball, little);
        let text = String::from_utf8_lossy(&whole).into_owned();
        let body = text.find("end_header\n").unwrap() + 11;
        let mut claims = whole.clone();
        let at = text.find("face 20").unwrap();
        claims.splice(at..at + 7, *b"face 2147483648");
        assert!(refused(Format::Ply, &claims).contains("element face: claims 2147483648"));
        let mut nan = whole.clone();
        nan[body + 25..body + 33].copy_from_slice(&f64::NAN.to_le_bytes().map(|_| 0xff));
        assert!(refused(Format::Ply, &nan).contains("vertex 1: x is NaN"));
        let mut corners = whole.clone();
        corners[body + 12 * 25] = 255;
        assert!(refused(Format::Ply, &corners).contains("face"));
        let mut index = whole.clone();
        index[body + 12 * 25 + 1..][..4].copy_from_slice(&[0xff; 4]);
        assert!(refused(Format::Ply, &index).contains("face 0: has vertex -1"));
    }

    let (json, chunk) = glb_parts(&ball, r#"{"mesh":0}"#);
    let edits = [
        ("\"count\":12", "\"count\":2147483648", "accessor 0 claims 2147483648"),
        ("\"count\":12", "\"count\":0", ""),
        ("\"count\":12", "\"count\":-1", ""),
        ("\"count\":12", "\"count\":11", "has vertex 11, but only 11"),
        ("\"count\":60", "\"count\":18446744073709551615", "accessor 1"),
        ("\"byteOffset\":144", "\"byteOffset\":18446744073709551615", "buffer view 1"),
        ("\"byteLength\":144", "\"byteLength\":99999", "buffer view 0"),
        ("\"POSITION\":0", "\"POSITION\":1", "positions"),
        ("\"POSITION\":0", "\"POSITION\":9", ""),
        ("\"POSITION\":0", "\"NORMAL\":0", ""),
        ("5125", "5126", "indices"),
        ("\"nodes\":[0]", "\"nodes\":[7]", ""),
        ("\"mesh\":0", "\"mesh\":3", ""),
        ("\"buffers\":[{", "\"buffers\":[{\"uri\":\"../../secret\",", "another file"),
        ("\"scene\":0", "\"extensionsRequired\":[\"KHR_draco_mesh_compression\"],\"scene\":0", ""),
        ("{\"asset\"", "[\"asset\"", ""),
    ];
    for (from, to, word) in edits {
        assert!(json.contains(from), "{from}");
        let message = refused(Format::Glb, &glb_of(&json.replacen(from, to, 1), &chunk));
        assert!(message.contains(word), "{from} -> {to}: '{message}' doesn't say '{word}'");
    }
    assert!(refused(Format::Glb, json.as_bytes()).contains("save it as one .glb"));
    assert!(refused(Format::Glb, b"glTF").contains("byte 4"));
    let deep = "[".repeat(100_000);
    refused(Format::Glb, &glb_of(&deep, &[]));
}
