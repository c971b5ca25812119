// Rays that came from the host, one by one. Twin: the Source of sdfrs_core::Rays in
// crates/sdfrs-trace/src/march.rs.

@group(0) @binding(1) var<storage, read> rays: array<Ray>;

fn ray_of(i: u32) -> Ray {
    return rays[i];
}
