use super::*;

fn camera() -> Camera {
    Camera {
        kind: Kind::Pinhole { fov_deg: 90.0 },
        origin: [0.0, 0.0, 5.0],
        target: [0.0; 3],
        up: [0.0, 1.0, 0.0],
        width: 4,
        height: 2,
    }
}

#[test]
fn top_left_pixel_looks_up_and_left() {
    let (o, d) = camera().ray(0, 0).unwrap();
    let length = (1.5f64 * 1.5 + 0.5 * 0.5 + 1.0).sqrt();
    assert_eq!(o, [0.0, 0.0, 5.0]);
    for (got, want) in d.iter().zip([-1.5, 0.5, -1.0]) {
        assert!((got - want / length).abs() < 1e-15, "{d:?}");
    }
}

#[test]
fn centre_looks_at_the_target() {
    let mut c = camera();
    (c.width, c.height, c.origin, c.target) = (5, 7, [3.0, 2.0, 4.0], [-1.0, 0.5, 0.25]);
    let (_, d) = c.ray(2, 3).unwrap();
    let want = unit(DVec3::from(c.target) - DVec3::from(c.origin)).unwrap().to_array();
    assert!((0..3).all(|i| (d[i] - want[i]).abs() < 1e-15));
}

#[test]
fn orthographic_rays_are_parallel_and_spread_over_the_extent() {
    let mut c = camera();
    c.kind = Kind::Orthographic { extent: 2.0 };
    let (o, d) = c.ray(3, 1).unwrap();
    assert_eq!((o, d), ([1.5, -0.5, 5.0], [0.0, 0.0, -1.0]));
}

#[test]
fn all_rays_are_row_major_and_of_unit_length() {
    let c = camera().resized(31, 17);
    let (o, d) = c.rays::<f64>().unwrap();
    assert_eq!((o.len(), d.len()), (31 * 17, 31 * 17));
    assert_eq!((o[31 * 5 + 7], d[31 * 5 + 7]), c.ray(7, 5).unwrap());
    assert!(d.iter().all(|v| (DVec3::from(*v).length_squared() - 1.0).abs() < 1e-15));
    assert!(d[0][1] > d[31 * 16][1], "row 0 is the top");
}

#[test]
fn huge_and_tiny_distances_have_directions() {
    for scale in [1e-300, 1e-30, 1e30, 1e300] {
        let mut c = camera();
        (c.origin, c.up) = ([0.0, 0.0, scale], [0.0, 1.0 / scale, 0.0]);
        assert_eq!(c.ray(1, 1).unwrap().1, camera().ray(1, 1).unwrap().1, "{scale}");
    }
}

#[test]
fn refuses_what_has_no_picture() {
    type Change = fn(&mut Camera);
    let cases: [(&str, Change); 14] = [
        ("origin", |c| c.origin[1] = f64::NAN),
        ("target", |c| c.target[0] = f64::INFINITY),
        ("up", |c| c.up[2] = f64::NEG_INFINITY),
        ("target", |c| c.target = c.origin),
        ("target", |c| (c.origin, c.target) = ([1.5e308, 0.0, 0.0], [-1.5e308, 0.0, 0.0])),
        ("up", |c| c.up = [0.0, 0.0, -3.0]),
        ("up", |c| c.up = [0.0; 3]),
        ("fov", |c| c.kind = Kind::Pinhole { fov_deg: 0.0 }),
        ("fov", |c| c.kind = Kind::Pinhole { fov_deg: 180.0 }),
        ("fov", |c| c.kind = Kind::Pinhole { fov_deg: f64::NAN }),
        ("extent", |c| c.kind = Kind::Orthographic { extent: -1.0 }),
        ("extent", |c| c.kind = Kind::Orthographic { extent: f64::INFINITY }),
        ("image", |c| c.width = 0),
        ("image", |c| c.height = 65537),
    ];
    for (i, (word, change)) in cases.into_iter().enumerate() {
        let mut c = camera();
        change(&mut c);
        let error = c.check().expect_err("case must be refused");
        assert!(error.op.contains(word), "case {i}: {error}");
    }
    assert!(camera().ray(4, 0).is_err());
    assert!(camera().check().is_ok());
}
