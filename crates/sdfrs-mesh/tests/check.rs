//! What the check believes, repairs and reports.
#![allow(clippy::unwrap_used, clippy::panic)]

#[path = "signs/meshes.rs"]
mod meshes;

use meshes::{beheaded, both, cube, doubled, flipped, icosphere, moved, slivered, soup, torus};
use sdfrs_mesh::check::{Findings, check};
use sdfrs_mesh::{Mesh, MeshError};

fn found(mesh: &Mesh) -> Findings {
    check(mesh).unwrap().1
}

fn refused(mesh: &Mesh) -> String {
    match check(mesh) {
        Err(error @ MeshError::Bad { .. }) => error.to_string(),
        other => panic!("{other:?}"),
    }
}

#[test]
fn a_whole_mesh_is_found_whole() {
    for (mesh, volume) in
        [(icosphere(3), 4.19 * 0.99), (torus(1.0, 0.3, 40, 20), 1.776 * 0.98), (cube(3), 8.0)]
    {
        let f = found(&mesh);
        assert!(f.watertight && f.manifold && f.oriented && f.closed(), "{f:?}");
        assert_eq!(
            (f.boundary_edges, f.nonmanifold_edges, f.nonmanifold_vertices, f.misoriented_edges),
            (0, 0, 0, 0)
        );
        assert_eq!(
            (f.degenerate_faces, f.duplicate_faces, f.welded_vertices, f.unused_vertices),
            (0, 0, 0, 0)
        );
        assert_eq!((f.components, f.faces), (1, mesh.faces.len() as u64));
        assert!((f.signed_volume / volume - 1.0).abs() < 0.02, "{}", f.signed_volume);
    }
}

#[test]
fn each_defect_is_counted() {
    let sphere = icosphere(3);
    let mut open = sphere.clone();
    open.faces.pop();
    assert_eq!((found(&open).boundary_edges, found(&open).watertight), (3, false));

    let mut turned = sphere.clone();
    turned.faces[7].swap(0, 1);
    assert_eq!((found(&turned).misoriented_edges, found(&turned).oriented), (3, false));
    assert!(found(&turned).watertight && found(&turned).manifold);

    let inside_out = found(&flipped(sphere.clone(), 1.0, 1));
    assert!(inside_out.signed_volume < 0.0 && inside_out.closed());

    let again = found(&doubled(sphere.clone(), 0.1, 2));
    assert!(again.duplicate_faces > 50 && again.closed() && again.manifold, "{again:?}");

    let f = found(&soup(&sphere));
    assert_eq!(f.welded_vertices, 3 * 1280 - 642);
    assert!(f.closed() && f.manifold && f.components == 1);

    let f = found(&slivered(sphere.clone(), 0.1, 3));
    assert!(f.degenerate_faces > 200 && f.needle_faces > 0 && f.needle_faces < f.degenerate_faces, "{f:?}");
    assert!(f.watertight && f.oriented, "a needle's edges still count");

    let two = both(sphere.clone(), &moved(sphere.clone(), [3.0, 0.0, 0.0], 1.0));
    assert_eq!(found(&two).components, 2);
    assert!(!found(&beheaded(sphere.clone(), 0.05)).watertight);

    let mut spare = sphere;
    spare.vertices.push([9.0; 3]);
    assert_eq!((found(&spare).unused_vertices, found(&spare).bounds.1[0] < 1.1), (1, true));
}

#[test]
fn what_touches_in_a_point_or_along_an_edge_is_no_manifold() {
    let corner = both(cube(2), &moved(cube(2), [2.0; 3], 1.0));
    let f = found(&corner);
    assert_eq!((f.nonmanifold_edges, f.nonmanifold_vertices, f.manifold), (0, 1, false));
    let edge = both(cube(2), &moved(cube(2), [2.0, 2.0, 0.0], 1.0));
    let f = found(&edge);
    assert_eq!((f.nonmanifold_edges, f.manifold, f.closed()), (2, false, true));
}

#[test]
fn faces_in_both_orders_all_stay() {
    let mut mesh = icosphere(1);
    let [a, b, c] = mesh.faces[5];
    mesh.faces.extend([[b, a, c], [b, c, a]]);
    assert_eq!(found(&mesh).duplicate_faces, 0);
}

#[test]
fn place_and_size_change_nothing() {
    let mesh = torus(1.0, 0.4, 30, 20);
    let (plain, plain_found) = check(&mesh).unwrap();
    for power in [-66, -20, 10, 66] {
        let scale = 2.0_f64.powi(power);
        let (moved, found) = check(&moved(mesh.clone(), [0.0; 3], scale)).unwrap();
        assert_eq!((&moved.vertices, &moved.faces), (&plain.vertices, &plain.faces));
        assert_eq!(moved.scale, plain.scale * scale);
        assert_eq!(found.signed_volume, plain_found.signed_volume * scale * scale * scale);
    }
    for (by, scale) in [(1e6, 1.0), (1e8, 1.0), (0.0, 1e-20), (0.0, 1e20), (3e300, 1e300), (0.0, 1e-300)] {
        let (moved, found) = check(&moved(mesh.clone(), [by; 3], scale)).unwrap();
        assert!(found.closed() && found.manifold && found.degenerate_faces == 0, "{by} {scale}: {found:?}");
        for v in &moved.vertices {
            assert!(v.iter().all(|x| x.abs() <= 1.0), "{v:?}");
        }
        assert!(moved.vertices.iter().flatten().any(|x| x.abs() > 0.4));
    }
}

#[test]
fn a_face_without_area_does_not_stretch_the_frame() {
    let mut mesh = icosphere(2);
    mesh.vertices.push([1e30, 0.0, 0.0]);
    let far = (mesh.vertices.len() - 1) as u32;
    mesh.faces.push([far, far, 0]);
    let (checked, found) = check(&mesh).unwrap();
    assert_eq!((found.degenerate_faces, checked.faces.len(), checked.scale), (1, 320, 1.0));
    assert!(found.closed());
}

#[test]
fn what_cannot_be_baked_is_refused_by_name() {
    let sphere = icosphere(1);
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        let mut mesh = sphere.clone();
        mesh.vertices[17][1] = bad;
        let message = refused(&mesh);
        assert!(message.contains("vertex 17") && message.contains('y'), "{message}");
    }
    let mut mesh = sphere.clone();
    mesh.faces[3][2] = 4000;
    let message = refused(&mesh);
    assert!(
        message.contains("face 3") && message.contains("4000") && message.contains("0 to 41"),
        "{message}"
    );

    assert!(refused(&Mesh::default()).contains("0 vertices and 0 faces"));
    assert!(refused(&Mesh { vertices: sphere.vertices.clone(), faces: vec![] }).contains("0 faces"));
    let line = Mesh { vertices: vec![[0.0; 3], [1.0; 3], [2.0; 3]], faces: vec![[0, 1, 2], [0, 0, 1]] };
    assert!(refused(&line).contains("none of the 2"));

    let one = Mesh { vertices: vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], faces: vec![[0, 1, 2]] };
    let f = found(&one);
    assert_eq!((f.boundary_edges, f.watertight, f.components), (3, false, 1));
}
