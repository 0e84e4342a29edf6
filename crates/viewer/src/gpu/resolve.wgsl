// From path lengths to grey values. Derivation: xray/beam.rs.

struct View {
    half_size: vec2f,
    focal_px: f32,
    sod_mm: f32,
}

struct Beam {
    mu_tissue: f32,
    mu_lumen: f32,
    tissue_mm: f32,
    white: f32,
    span: f32,
    subrays: u32,
}

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<uniform> beam: Beam;
@group(0) @binding(2) var lumen_mm: texture_2d<f32>;
@group(0) @binding(3) var excess: texture_2d<f32>;

@vertex
fn vertex(@builtin(vertex_index) index: u32) -> @builtin(position) vec4f {
    // One triangle that covers the picture.
    return vec4f(f32(index & 1u) * 4.0 - 1.0, f32(index & 2u) * 2.0 - 1.0, 0.5, 1.0);
}

@fragment
fn fragment(@builtin(position) position: vec4f) -> @location(0) f32 {
    let pixel = vec2u(position.xy);
    var sum = 0.0;
    for (var y = 0u; y < beam.subrays; y++) {
        for (var x = 0u; x < beam.subrays; x++) {
            let ray = pixel * beam.subrays + vec2u(x, y);
            let slopes = (vec2f(ray) + 0.5 - view.half_size) / view.focal_px;
            let lumen = textureLoad(lumen_mm, ray, 0).x;
            let body = beam.tissue_mm * length(vec3f(slopes, 1.0));
            let p = beam.mu_tissue * max(body - lumen, 0.0) + beam.mu_lumen * lumen
                + textureLoad(excess, ray, 0).x;
            sum += exp(-min(p - beam.white, 80.0));
        }
    }
    let mean = sum / f32(beam.subrays * beam.subrays);
    let value = clamp(1.0 + log(mean) / beam.span, 0.0, 1.0);
    let noise = fract(52.982918 * fract(dot(vec2f(pixel), vec2f(0.06711056, 0.00583715))));
    return floor(value * 255.0 + noise) / 255.0;
}
