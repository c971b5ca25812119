// What rays have come to, and those that are still active: two lists, one read and one written, and what the host wants to know at
// once. Which place a ray gets depends on the order of the threads; what becomes of it does not.

struct Lists {
    // Rays that this pass leaves active.
    kept: atomic<u32>,
    // Bits of the largest threshold that decided a hit; positive floats compare like their bits.
    threshold: atomic<u32>,
    // Points by the length of the program they ran: see field/counted.wgsl.
    points: array<atomic<u32>, LENGTHS>,
    // The halves: u.rays entries each.
    live: array<u32>,
}

@group(0) @binding(2) var<storage, read_write> lists: Lists;
@group(0) @binding(3) var<storage, read_write> walkers: array<Walker>;
@group(0) @binding(4) var<storage, read_write> tallies: array<Tally>;

// Puts the n-th ray on the first list, and says which it is.
fn begin_ray(n: u32) -> u32 {
    var k = n;
    if u.blocks != 0u {
        k = in_blocks(n);
    }
    lists.live[n] = k;
    return k;
}

// The n-th ray of this dispatch.
fn active_ray(n: u32) -> u32 {
    return lists.live[u.half_read * u.rays + u.first + n];
}

// The ray goes on in the next pass.
fn keep_ray(k: u32) {
    lists.live[(1u - u.half_read) * u.rays + atomicAdd(&lists.kept, 1u)] = k;
}

// The ray in the n-th place of an image tile: blocks of 8 x 8 pixels, so that neighbours step together.
fn in_blocks(n: u32) -> u32 {
    let band = n / (8u * u.width);
    let rows = u.rays / u.width;
    let tall = min(8u, rows - 8u * band);
    let inside = n - band * 8u * u.width;
    let block = inside / (8u * tall);
    let wide = min(8u, u.width - 8u * block);
    let place = inside - block * 8u * tall;
    return (8u * band + place / wide) * u.width + 8u * block + place % wide;
}
