// Signed depth of a closed mesh. Derivation: gpu/fluoro.rs.

struct View {
    half_size: vec2f,
    focal_px: f32,
    sod_mm: f32,
}

@group(0) @binding(0) var<uniform> view: View;

struct Corner {
    @builtin(position) clip: vec4f,
    @location(0) @interpolate(flat) plane: vec4f,
    @location(1) @interpolate(flat) range: vec2f,
}

@vertex
fn vertex(
    @location(0) position: vec3f,
    @location(1) plane: vec4f,
    @location(2) range: vec2f,
) -> Corner {
    let depth = view.sod_mm + position.z;
    let xy = view.focal_px * position.xy / view.half_size;
    return Corner(vec4f(xy.x, -xy.y, 0.5 * depth, depth), plane, range);
}

@fragment
fn fragment(corner: Corner, @builtin(front_facing) entering: bool) -> @location(0) f32 {
    let slopes = (corner.clip.xy - view.half_size) / view.focal_px;
    let ray = vec3f(slopes, 1.0);
    // The ray from (0, 0, -sod) meets n . p = k at depth c: c (n . ray) = k - sod (n.xy . slopes).
    let across = dot(corner.plane.xyz, ray);
    let reach = corner.plane.w - view.sod_mm * dot(corner.plane.xy, slopes);
    // A triangle seen edge-on has no certain depth, but none outside its corners either.
    var depth = 0.5 * (corner.range.x + corner.range.y);
    if across != 0.0 {
        depth = clamp(reach / across, corner.range.x, corner.range.y);
    }
    return select(depth, -depth, entering) * length(ray);
}
