// Signed depth of a closed mesh. Derivation: gpu/fluoro.rs and cpu/raster.rs.

struct View {
    half_size: vec2f,
    focal_px: f32,
}

@group(0) @binding(0) var<uniform> view: View;

struct Facet {
    @builtin(position) clip: vec4f,
    // Column, row, and parts of the grid beyond them.
    @location(0) @interpolate(flat) a: vec4i,
    @location(1) @interpolate(flat) b: vec4i,
    @location(2) @interpolate(flat) c: vec4i,
    @location(3) @interpolate(flat) inverse: vec3f,
    // Three signed depths, and the turn of the ordered corners.
    @location(4) @interpolate(flat) depths: vec4f,
}

@vertex
fn vertex(
    @builtin(vertex_index) index: u32,
    @location(0) frame: vec4u,
    @location(1) a: vec4i,
    @location(2) b: vec4i,
    @location(3) c: vec4i,
    @location(4) inverse: vec3f,
    @location(5) depths: vec4f,
) -> Facet {
    let corner = select(frame.xy, frame.zw, vec2<bool>((index & 1u) != 0u, (index & 2u) != 0u));
    let xy = vec2f(corner) / view.half_size - 1.0;
    return Facet(vec4f(xy.x, -xy.y, 0.5, 1.0), a, b, c, inverse, depths);
}

const GRID = 1048576;

// A number of the grid in digits of 11 bits; the last has the sign.
fn digits(whole: i32, part: i32) -> vec3i {
    let upper = (part >> 11u) + whole * (GRID >> 11u);
    return vec3i(part & 2047, upper & 2047, upper >> 11u);
}

// Whether d.x r.y >= d.y r.x, each with its whole pixels in xy and parts of the grid in zw.
fn is_positive(d: vec4i, r: vec4i) -> bool {
    let a = digits(d.x, d.z);
    let b = digits(r.y, r.w);
    let c = digits(d.y, d.w);
    let e = digits(r.x, r.z);
    var carry = a.x * b.x - c.x * e.x;
    carry = (carry >> 11u) + a.x * b.y + a.y * b.x - c.x * e.y - c.y * e.x;
    carry = (carry >> 11u) + a.x * b.z + a.y * b.y + a.z * b.x - c.x * e.z - c.y * e.y - c.z * e.x;
    carry = (carry >> 11u) + a.y * b.z + a.z * b.y - c.y * e.z - c.z * e.y;
    return (carry >> 11u) + a.z * b.z - c.z * e.z >= 0;
}

struct Edge {
    size: f32,
    positive: bool,
}

// The edge function of ordered ends at a pixel's centre.
fn edge(from_corner: vec4i, to_corner: vec4i, centre: vec4i) -> Edge {
    let d = to_corner - from_corner;
    let r = centre - from_corner;
    let along = vec2f(d.xy) + vec2f(d.zw) / f32(GRID);
    let reach = vec2f(r.xy) + vec2f(r.zw) / f32(GRID);
    let value = along.x * reach.y - along.y * reach.x;
    // Four times what rounding may take.
    let unsure = 1e-6 * (abs(along.x * reach.y) + abs(along.y * reach.x));
    if abs(value) > unsure {
        return Edge(abs(value), value > 0.0);
    }
    return Edge(abs(value), is_positive(d, r));
}

@fragment
fn fragment(facet: Facet) -> @location(0) f32 {
    let centre = vec4i(vec2i(facet.clip.xy), vec2i(GRID / 2));
    let ab = edge(facet.a, facet.b, centre);
    let bc = edge(facet.b, facet.c, centre);
    let ac = edge(facet.a, facet.c, centre);
    let turns = facet.depths.w > 0.0;
    if ab.positive != turns || bc.positive != turns || ac.positive == turns {
        discard;
    }
    // On a plane 1/depth is linear over the picture.
    let weights = vec3f(bc.size, ac.size, ab.size) * facet.inverse;
    let sum = weights.x + weights.y + weights.z;
    var depth = (facet.depths.x + facet.depths.y + facet.depths.z) / 3.0;
    if sum > 0.0 {
        depth = dot(weights, facet.depths.xyz) / sum;
    }
    let slopes = (facet.clip.xy - view.half_size) / view.focal_px;
    return depth * length(vec3f(slopes, 1.0));
}
