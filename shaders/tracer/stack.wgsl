// A ray's stack of spans: u.depth entries, those of all rays side by side so that neighbours' lie together.
// Twin: the vectors of binary_search.rs, split.rs and coverage_search.rs in crates/sdfrs-trace/src/tracer.

@group(0) @binding(5) var<storage, read_write> stack: array<vec2<f32>>;

// The ray whose stack it is.
var<private> stack_of: u32;

fn stack_get(i: u32) -> vec2<f32> {
    return stack[i * u.rays + stack_of];
}

fn stack_put(i: u32, span: vec2<f32>) {
    stack[i * u.rays + stack_of] = span;
}

fn select_stack(ray: u32) {
    stack_of = ray;
}
