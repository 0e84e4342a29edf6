//! Fluoroscopic frames through wgpu: signed depth by rasterisation.
//!
//! Faces are added into a float target, minus their distance along the ray where they face the source and plus where
//! they do not; the sum is the length inside (see `cpu/wall.rs`). Distances are measured from the plane through the
//! isocentre across the beam: being constant along a ray, the shift cancels in the sum, and f32 has its digits for
//! millimetres rather than for the 750 mm before them.
//!
//! **The shader decides which pixels a triangle covers**, by the rules of `cpu/raster.rs` on the same corners. An
//! adapter's own rasteriser rounds corners to 1/256 of a pixel or coarser, which moves silhouettes: a ray then hits a
//! rib or does not. So the adapter draws rectangles of whole pixels, and each pixel evaluates the edge functions: in
//! f32 where that determines their sign, otherwise exactly in integers.
//!
//! Devices cover few pixels, and are cast by the processor (`cpu/cells.rs`).

use std::cmp::Ordering;
use std::collections::HashMap;

use bytemuck::{Pod, Zeroable};
use endowire_core::Result;
use endowire_core::vessel::SurfaceMesh;
use rayon::prelude::*;

use crate::c_arm::CArm;
use crate::cpu::{GRID, ScreenTriangle, seen};
use crate::engine::PathEngine;
use crate::gpu::context::{Gpu, Reading, color_pass};

const PATH_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::R32Float;
/// Largest distance of corners from the image, pixels, to which farther ones are clamped: the shader's integer
/// products must not overflow.
const FARTHEST_PX: f64 = 32768.0;

/// A triangle in the shader's format, its corners from left to right, and those above each other downwards.
#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct Facet {
    /// First column and row that it may cover, and one past the last.
    frame: [u16; 4],
    /// Column and row of each corner, and their fractions in units of the grid.
    corners: [[i32; 4]; 3],
    /// Inverse depth of each corner from the source.
    inverse: [f32; 3],
    /// Depth of each corner from the isocentre, negative where rays enter; then the orientation of the ordered
    /// corners.
    depths: [f32; 4],
}

impl Facet {
    /// `None` if it covers no pixel.
    fn new(corners: [([f64; 2], f64); 3], view: &CArm) -> Option<Self> {
        let triangle = ScreenTriangle::on_grid(corners.map(|(pixel, _)| pixel))?;
        let [xs, ys] = triangle.frame(view.size_px());
        if xs.is_empty() || ys.is_empty() {
            return None;
        }
        let sign = -triangle.area2().signum();
        let mut ordered = corners;
        ordered.sort_by(|(a, _), (b, _)| a.partial_cmp(b).unwrap_or(Ordering::Equal));
        let turn = ScreenTriangle::on_grid(ordered.map(|(pixel, _)| pixel))?.area2().signum();
        let [a, b, c] = ordered.map(|(_, inverse)| (sign * (1.0 / inverse - view.sod_mm())) as f32);
        Some(Self {
            frame: [xs.start, ys.start, xs.end, ys.end].map(|n| n as u16),
            corners: ordered.map(|(pixel, _)| {
                let [x, y] = pixel.map(|at| at.clamp(-FARTHEST_PX, FARTHEST_PX));
                let part = |at: f64| ((at - at.floor()) * GRID) as i32;
                [x.floor() as i32, y.floor() as i32, part(x), part(y)]
            }),
            inverse: ordered.map(|(_, inverse)| inverse as f32),
            depths: [a, b, c, turn as f32],
        })
    }
}

/// The shader's uniform for a C-arm.
#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct ViewUniform {
    half_size: [f32; 2],
    focal_px: f32,
    unused: f32,
}

impl ViewUniform {
    fn new(c_arm: &CArm) -> Self {
        Self {
            half_size: c_arm.size_px().map(|n| n as f32 / 2.0),
            focal_px: c_arm.focal_px() as f32,
            unused: 0.0,
        }
    }
}

/// Pipeline, and a target for each image size.
#[derive(Debug)]
pub(crate) struct GpuPaths {
    gpu: Gpu,
    draw_wall: wgpu::RenderPipeline,
    targets: HashMap<[u32; 2], wgpu::Texture>,
}

impl GpuPaths {
    pub(crate) fn new(gpu: &Gpu) -> Self {
        let draw_wall = gpu.paths.get_or_init(|| path_pipeline(gpu)).clone();
        Self { gpu: gpu.clone(), draw_wall, targets: HashMap::new() }
    }

    /// Draws a mesh into a target of the size of `view`; returns the read-back of its lengths.
    pub(crate) fn submit(&mut self, view: &CArm, mesh: &SurfaceMesh) -> Result<Reading> {
        let facets = facets(view, mesh);
        let (gpu, pipeline) = (&self.gpu, &self.draw_wall);
        let target =
            self.targets.entry(view.size_px()).or_insert_with_key(|size| gpu.target(*size, PATH_FORMAT, 1));
        let uniform = gpu.buffer(bytemuck::bytes_of(&ViewUniform::new(view)), wgpu::BufferUsages::UNIFORM);
        let group = gpu.bind(pipeline, &[uniform.as_entire_binding()]);
        let buffer = (!facets.is_empty())
            .then(|| gpu.buffer(bytemuck::cast_slice(&facets), wgpu::BufferUsages::VERTEX));
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        {
            let texture = target.create_view(&Default::default());
            let mut pass = color_pass(&mut encoder, &texture, wgpu::Color::TRANSPARENT);
            if let Some(buffer) = &buffer {
                pass.set_pipeline(pipeline);
                pass.set_bind_group(0, &group, &[]);
                pass.set_vertex_buffer(0, buffer.slice(..));
                pass.draw(0..4, 0..facets.len() as u32);
            }
        }
        gpu.submit(encoder, target)
    }
}

/// The lengths that were read.
pub(crate) async fn lengths(reading: Reading) -> Result<Vec<f32>> {
    let bytes = reading.bytes().await?;
    Ok(bytes.chunks_exact(4).map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect())
}

impl PathEngine for GpuPaths {
    fn mesh(&mut self, view: &CArm, mesh: &SurfaceMesh) -> Result<Vec<f32>> {
        pollster::block_on(lengths(self.submit(view, mesh)?))
    }
}

/// The triangles of a mesh that cover a pixel, in order.
fn facets(view: &CArm, mesh: &SurfaceMesh) -> Vec<Facet> {
    let seen = seen(view, mesh);
    let facet = |corners: &[u32; 3]| Facet::new(corners.map(|corner| seen[corner as usize]), view);
    mesh.triangles.par_iter().filter_map(facet).collect()
}

/// A pipeline that adds path lengths.
fn path_pipeline(gpu: &Gpu) -> wgpu::RenderPipeline {
    let layout = wgpu::VertexBufferLayout {
        array_stride: size_of::<Facet>() as u64,
        step_mode: wgpu::VertexStepMode::Instance,
        attributes: &wgpu::vertex_attr_array![
            0 => Uint16x4, 1 => Sint32x4, 2 => Sint32x4, 3 => Sint32x4, 4 => Float32x3, 5 => Float32x4
        ],
    };
    let shader = gpu.shader(include_str!("wall.wgsl"));
    let add = wgpu::BlendComponent {
        src_factor: wgpu::BlendFactor::One,
        dst_factor: wgpu::BlendFactor::One,
        operation: wgpu::BlendOperation::Add,
    };
    let target = wgpu::ColorTargetState {
        format: PATH_FORMAT,
        blend: Some(wgpu::BlendState { color: add, alpha: add }),
        write_mask: wgpu::ColorWrites::ALL,
    };
    gpu.device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some("path lengths"),
        layout: None,
        vertex: vertex_state(&shader, &[Some(layout)]),
        primitive: wgpu::PrimitiveState {
            topology: wgpu::PrimitiveTopology::TriangleStrip,
            ..Default::default()
        },
        depth_stencil: None,
        multisample: wgpu::MultisampleState::default(),
        fragment: Some(fragment_state(&shader, &[Some(target)])),
        multiview_mask: None,
        cache: None,
    })
}

fn vertex_state<'a>(
    module: &'a wgpu::ShaderModule,
    buffers: &'a [Option<wgpu::VertexBufferLayout<'a>>],
) -> wgpu::VertexState<'a> {
    wgpu::VertexState {
        module,
        entry_point: Some("vertex"),
        compilation_options: Default::default(),
        buffers,
    }
}

fn fragment_state<'a>(
    module: &'a wgpu::ShaderModule,
    targets: &'a [Option<wgpu::ColorTargetState>],
) -> wgpu::FragmentState<'a> {
    wgpu::FragmentState {
        module,
        entry_point: Some("fragment"),
        compilation_options: Default::default(),
        targets,
    }
}
