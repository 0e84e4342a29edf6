//! Fluoroscopic frames through wgpu: signed depth by rasterisation.
//!
//! Faces are added into a float target, minus their distance along the ray where they face the source and
//! plus where they do not; what remains is the length inside (see `cpu/wall.rs`). Distances are taken from
//! the plane through the isocentre across the beam: being constant along a ray, the shift cancels in the sum,
//! and f32 keeps its digits for millimetres rather than for the 750 mm before them. Each pixel intersects its
//! own ray with the triangle's plane, so the rasteriser's rounding of corners to 1/256 pixel moves
//! silhouettes only. All depths are given as the middle of the clip range: no plane can cut the mesh.
//!
//! Devices are few pixels, and cast by the processor (`cpu/cells.rs`).

use std::collections::HashMap;

use bytemuck::{Pod, Zeroable};
use endowire_core::Result;
use endowire_core::vessel::SurfaceMesh;

use crate::c_arm::CArm;
use crate::engine::PathEngine;
use crate::gpu::context::{Gpu, Reading, color_pass};

const PATH_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::R32Float;

/// A corner of the wall, with what its triangle's pixels need.
#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct WallVertex {
    /// In beam coordinates from the isocentre.
    position: [f32; 3],
    /// Unit normal and its product with a point of the plane.
    plane: [f32; 4],
    /// Least and greatest depth of the triangle.
    range: [f32; 2],
}

/// The shader's view of a C-arm.
#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct ViewUniform {
    half_size: [f32; 2],
    focal_px: f32,
    sod_mm: f32,
}

impl ViewUniform {
    fn new(c_arm: &CArm) -> Self {
        Self {
            half_size: c_arm.size_px().map(|n| n as f32 / 2.0),
            focal_px: c_arm.focal_px() as f32,
            sod_mm: c_arm.sod_mm() as f32,
        }
    }
}

/// Pipeline, and a target for each size of picture.
#[derive(Debug)]
pub(crate) struct GpuPaths {
    gpu: Gpu,
    draw_wall: wgpu::RenderPipeline,
    targets: HashMap<[u32; 2], wgpu::Texture>,
}

impl GpuPaths {
    pub(crate) fn new(gpu: &Gpu) -> Self {
        let draw_wall = path_pipeline(
            gpu,
            include_str!("wall.wgsl"),
            &wgpu::VertexBufferLayout {
                array_stride: size_of::<WallVertex>() as u64,
                step_mode: wgpu::VertexStepMode::Vertex,
                attributes: &wgpu::vertex_attr_array![0 => Float32x3, 1 => Float32x4, 2 => Float32x2],
            },
        );
        Self { gpu: gpu.clone(), draw_wall, targets: HashMap::new() }
    }

    /// Draws a mesh into a target of the size of `view`; what reads the lengths in it.
    pub(crate) fn submit(&mut self, view: &CArm, mesh: &SurfaceMesh) -> Result<Reading> {
        let vertices = wall_vertices(view, mesh);
        let (gpu, pipeline) = (&self.gpu, &self.draw_wall);
        let target =
            self.targets.entry(view.size_px()).or_insert_with_key(|size| gpu.target(*size, PATH_FORMAT, 1));
        let uniform = gpu.buffer(bytemuck::bytes_of(&ViewUniform::new(view)), wgpu::BufferUsages::UNIFORM);
        let group = gpu.bind(pipeline, &[uniform.as_entire_binding()]);
        let buffer = gpu.buffer(bytemuck::cast_slice(&vertices), wgpu::BufferUsages::VERTEX);
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        {
            let texture = target.create_view(&Default::default());
            let mut pass = color_pass(&mut encoder, &texture, wgpu::Color::TRANSPARENT);
            pass.set_pipeline(pipeline);
            pass.set_bind_group(0, &group, &[]);
            pass.set_vertex_buffer(0, buffer.slice(..));
            pass.draw(0..vertices.len() as u32, 0..1);
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

fn wall_vertices(c_arm: &CArm, wall: &SurfaceMesh) -> Vec<WallVertex> {
    let mut vertices = Vec::with_capacity(3 * wall.triangles.len());
    for i in 0..wall.triangles.len() {
        let corners = wall.corners(i).map(|v| c_arm.in_beam(&v));
        let normal = (corners[1] - corners[0]).cross(&(corners[2] - corners[0]));
        let normal = normal.try_normalize(0.0).unwrap_or_default();
        let offset = normal.dot(&corners[0]);
        let depths = corners.map(|c| c.z as f32);
        let range =
            [depths.into_iter().fold(f32::MAX, f32::min), depths.into_iter().fold(f32::MIN, f32::max)];
        vertices.extend(corners.map(|c| WallVertex {
            position: [c.x, c.y, c.z].map(|x| x as f32),
            plane: [normal.x, normal.y, normal.z, offset].map(|x| x as f32),
            range,
        }));
    }
    vertices
}

/// A pipeline that adds path lengths.
fn path_pipeline(
    gpu: &Gpu,
    source: &'static str,
    layout: &wgpu::VertexBufferLayout<'_>,
) -> wgpu::RenderPipeline {
    let shader = gpu.shader(source);
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
        vertex: vertex_state(&shader, &[Some(layout.clone())]),
        // Outward triangles turn clockwise on the screen where they face the source: the picture is seen from
        // the detector.
        primitive: wgpu::PrimitiveState { front_face: wgpu::FrontFace::Cw, ..Default::default() },
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
