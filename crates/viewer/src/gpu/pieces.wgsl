// Length of each ray inside one mitred frustum, times a weight. Derivation: cpu/piece.rs; here |D x a|^2
// stands for D.D - (D.a)^2 and so on (Lagrange's identity), which does not cancel.

struct View {
    half_size: vec2f,
    focal_px: f32,
    sod_mm: f32,
}

@group(0) @binding(0) var<uniform> view: View;

struct Piece {
    @location(0) rectangle: vec4f,
    @location(1) start_radius: vec4f,
    @location(2) axis_slope: vec4f,
    @location(3) plane0: vec4f,
    @location(4) plane1: vec4f,
    @location(5) weight: f32,
}

struct Corner {
    @builtin(position) clip: vec4f,
    @location(0) @interpolate(flat) start_radius: vec4f,
    @location(1) @interpolate(flat) axis_slope: vec4f,
    @location(2) @interpolate(flat) plane0: vec4f,
    @location(3) @interpolate(flat) plane1: vec4f,
    @location(4) @interpolate(flat) weight: f32,
}

@vertex
fn vertex(@builtin(vertex_index) index: u32, piece: Piece) -> Corner {
    // Two triangles: 0 1 2 and 2 1 3 of the rectangle's corners.
    var corners = array<u32, 6>(0u, 1u, 2u, 2u, 1u, 3u);
    let corner = corners[index];
    let pixel = vec2f(
        select(piece.rectangle.x, piece.rectangle.z, (corner & 1u) != 0u),
        select(piece.rectangle.y, piece.rectangle.w, (corner & 2u) != 0u),
    );
    let xy = pixel / view.half_size - 1.0;
    return Corner(
        vec4f(xy.x, -xy.y, 0.5, 1.0),
        piece.start_radius,
        piece.axis_slope,
        piece.plane0,
        piece.plane1,
        piece.weight,
    );
}

const FAR = 1e6;
const ALONG = 1e-10;

@fragment
fn fragment(piece: Corner) -> @location(0) f32 {
    let slopes = (piece.clip.xy - view.half_size) / view.focal_px;
    let ray = vec3f(slopes, 1.0);
    let start = piece.start_radius.xyz;
    let axis = piece.axis_slope.xyz;
    let slope = piece.axis_slope.w;
    // The ray at the depth of the first centre, relative to it.
    let q = vec3f((view.sod_mm + start.z) * slopes - start.xy, 0.0);

    let along = dot(ray, axis);
    let radius = piece.start_radius.w + slope * dot(q, axis);
    let ray_off = cross(ray, axis);
    let q_off = cross(q, axis);
    let a = dot(ray_off, ray_off) - slope * slope * along * along;
    let b = dot(ray_off, q_off) - slope * along * radius;
    let c = dot(q_off, q_off) - radius * radius;
    let disc = b * b - a * c;
    var interval = vec2f(-FAR, FAR);
    if a > ALONG {
        if disc <= 0.0 {
            return 0.0;
        }
        let root = sqrt(disc);
        interval = vec2f(-b - root, -b + root) / a;
    } else if a < -ALONG {
        if disc > 0.0 {
            let root = sqrt(disc);
            if slope * along > 0.0 {
                interval.x = (-b - root) / a;
            } else {
                interval.y = (-b + root) / a;
            }
        }
    } else if c > 0.0 {
        return 0.0;
    }
    // Mitre planes, crossed by the ray from its point on the plane of the isocentre: the same numbers for
    // both neighbours.
    let origin = vec3f(view.sod_mm * slopes, 0.0);
    let heights = vec2f(dot(piece.plane0.xyz, origin) - piece.plane0.w, dot(piece.plane1.xyz, origin) - piece.plane1.w);
    let rises = vec2f(dot(piece.plane0.xyz, ray), dot(piece.plane1.xyz, ray));
    let crossings = -heights / rises - start.z;
    if rises.x > 0.0 {
        interval.x = max(interval.x, crossings.x);
    } else if rises.x < 0.0 {
        interval.y = min(interval.y, crossings.x);
    } else if heights.x < 0.0 {
        return 0.0;
    }
    if rises.y > 0.0 {
        interval.y = min(interval.y, crossings.y);
    } else if rises.y < 0.0 {
        interval.x = max(interval.x, crossings.y);
    } else if heights.y >= 0.0 {
        return 0.0;
    }
    return piece.weight * max(interval.y - interval.x, 0.0) * length(ray);
}
