// The 3D view. Formulas and constants: three_d/style.rs; vertices come in view coordinates.

struct Style {
    background: vec4f,
    wall: vec4f,
    device: vec4f,
    lamp: vec4f,
    sheet: vec4f,
    frustum: vec4f,
    planes: vec4f,
}

@group(0) @binding(0) var<uniform> style: Style;
@group(0) @binding(1) var opaque_colour: texture_2d<f32>;
@group(0) @binding(2) var wall_sum: texture_2d<f32>;
@group(0) @binding(3) var wall_through: texture_2d<f32>;

struct Surface {
    @builtin(position) clip: vec4f,
    @location(0) position: vec3f,
    @location(1) normal: vec3f,
    @location(2) colour: vec4f,
}

@vertex
fn surface(@location(0) position: vec3f, @location(1) normal: vec3f, @location(2) colour: vec4f) -> Surface {
    let distance = -position.z;
    let near = style.planes.x;
    let far = style.planes.y;
    let depth = far * (distance - near) / (far - near);
    return Surface(vec4f(position.xy / style.frustum.xy, depth, distance), position, normal, colour);
}

@vertex
fn everywhere(@builtin(vertex_index) index: u32) -> @builtin(position) vec4f {
    return vec4f(f32(index & 1u) * 4.0 - 1.0, f32(index & 2u) * 2.0 - 1.0, 0.5, 1.0);
}

// 0 at the nearest, 1 at the farthest wall.
fn relative_depth(distance: f32) -> f32 {
    let front = style.frustum.z;
    return saturate((distance - front) / max(style.frustum.w - front, 1e-30));
}

@fragment
fn device(in: Surface) -> @location(0) vec4f {
    let to_eye = -normalize(in.position);
    let n = normalize(in.normal);
    let lamp = style.lamp.xyz;
    let half_way = normalize(lamp + to_eye);
    let light = 0.40 + 0.55 * max(dot(n, lamp), 0.0) + 0.25 * max(dot(n, to_eye), 0.0);
    let shine = style.device.w * pow(max(dot(n, half_way), 0.0), 24.0);
    return vec4f(saturate(in.colour.xyz * light + shine), 1.0);
}

struct Sheet {
    @location(0) sum: vec4f,
    @location(1) through: f32,
}

@fragment
fn wall(in: Surface) -> Sheet {
    let to_eye = -normalize(in.position);
    let outwards = normalize(in.normal);
    let inner = dot(outwards, to_eye) < 0.0;
    let n = select(outwards, -outwards, inner);
    let lamp = style.lamp.xyz;
    let half_way = normalize(lamp + to_eye);
    let facing = min(dot(n, to_eye), 1.0);
    let rim = pow(1.0 - facing, style.sheet.z);
    let shine = select(style.lamp.w * pow(max(dot(n, half_way), 0.0), 40.0), 0.0, inner);
    let light = (0.50 + 0.40 * max(dot(n, lamp), 0.0) + 0.25 * facing) * select(1.0, style.sheet.w, inner);
    let zeta = relative_depth(-in.position.z);
    let lit = style.wall.xyz * light * (1.0 - style.wall.w * rim) + shine;
    let colour = saturate(mix(lit, style.background.xyz, style.background.w * zeta));
    let alpha = min(style.sheet.x + (style.sheet.y - style.sheet.x) * rim + shine, 1.0);
    let near = 1.0 - 0.95 * zeta;
    let weight = max(near * near * near, 0.02);
    return Sheet(vec4f(colour, 1.0) * alpha * weight, 1.0 - alpha);
}

@fragment
fn compose(@builtin(position) position: vec4f) -> @location(0) vec4f {
    let pixel = vec2u(position.xy);
    let behind = textureLoad(opaque_colour, pixel, 0).xyz;
    let sum = textureLoad(wall_sum, pixel, 0);
    if sum.w <= 0.0 {
        return vec4f(behind, 1.0);
    }
    return vec4f(mix(sum.xyz / sum.w, behind, textureLoad(wall_through, pixel, 0).x), 1.0);
}
