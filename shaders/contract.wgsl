// What the passes of a march exchange with the processor; twin of contract.rs.
struct Params {
    // 0 at run time, unknown to compilers; see `hold`.
    zero: u32,
}

@group(0) @binding(0) var<uniform> u: Params;
