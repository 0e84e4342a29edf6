//! Fluoroscopic frames through wgpu: signed depth by rasterisation.
//!
//! Faces are added into a float target, minus their distance along the ray where they face the source and
//! plus where they do not; what remains is the length inside (see `cpu/wall.rs`). Distances are taken from
//! the plane through the isocentre across the beam: being constant along a ray, the shift cancels in the sum,
//! and f32 keeps its digits for millimetres rather than for the 750 mm before them. Each pixel intersects its
//! own ray with the triangle's plane, so the rasteriser's rounding of corners to 1/256 pixel moves
//! silhouettes only. All depths are given as the middle of the clip range: no plane can cut the mesh.
//!
//! Devices are rectangles, one for each mitred piece, whose pixels solve the cone of `cpu/piece.rs`.

use bytemuck::{Pod, Zeroable};
use endowire_core::Result;
use endowire_core::vessel::SurfaceMesh;

use crate::c_arm::CArm;
use crate::cpu::{pieces_in_beam, pixels_of};
use crate::device::Piece;
use crate::gpu::context::{Gpu, color_pass};
use crate::image::{Image, PixelFormat};
use crate::renderer::FluoroEngine;
use crate::scene::{FluoroSetup, RefinedDevice};
use crate::xray::SUBRAYS;

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

/// A mitred piece of a device.
#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct PieceInstance {
    /// Pixels it may touch: left, top, right, bottom.
    rectangle: [f32; 4],
    start_radius: [f32; 4],
    axis_slope: [f32; 4],
    /// Mitre planes: unit normals and their products with the centres.
    planes: [[f32; 4]; 2],
    weight: f32,
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

/// The shader's view of a beam.
#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct BeamUniform {
    mu_tissue: f32,
    mu_lumen: f32,
    tissue_mm: f32,
    white: f32,
    span: f32,
    subrays: u32,
    padding: [f32; 2],
}

/// Pipelines, the vessel and the targets of the fluoroscopic view.
#[derive(Debug)]
pub(crate) struct GpuFluoro {
    gpu: Gpu,
    setup: FluoroSetup,
    /// The C-arm with one pixel a ray.
    rays: CArm,
    wall: wgpu::Buffer,
    draw_wall: wgpu::RenderPipeline,
    draw_pieces: wgpu::RenderPipeline,
    resolve: wgpu::RenderPipeline,
    view: wgpu::Buffer,
    resolve_group: wgpu::BindGroup,
    excess: wgpu::TextureView,
    picture: wgpu::Texture,
}

impl GpuFluoro {
    pub(crate) fn new(gpu: &Gpu, setup: &FluoroSetup, wall: &SurfaceMesh) -> Self {
        let rays = setup.c_arm.refined(SUBRAYS);
        let vertices = wall_vertices(&rays, wall);
        let wall = gpu.buffer(bytemuck::cast_slice(&vertices), wgpu::BufferUsages::VERTEX);
        let draw_wall = path_pipeline(
            gpu,
            include_str!("wall.wgsl"),
            &wgpu::VertexBufferLayout {
                array_stride: size_of::<WallVertex>() as u64,
                step_mode: wgpu::VertexStepMode::Vertex,
                attributes: &wgpu::vertex_attr_array![0 => Float32x3, 1 => Float32x4, 2 => Float32x2],
            },
        );
        let draw_pieces = path_pipeline(
            gpu,
            include_str!("pieces.wgsl"),
            &wgpu::VertexBufferLayout {
                array_stride: size_of::<PieceInstance>() as u64,
                step_mode: wgpu::VertexStepMode::Instance,
                attributes: &wgpu::vertex_attr_array![
                    0 => Float32x4, 1 => Float32x4, 2 => Float32x4, 3 => Float32x4, 4 => Float32x4, 5 => Float32
                ],
            },
        );
        let shader = gpu.shader(include_str!("resolve.wgsl"));
        let resolve = gpu.device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some("resolve"),
            layout: None,
            vertex: vertex_state(&shader, &[]),
            primitive: wgpu::PrimitiveState::default(),
            depth_stencil: None,
            multisample: wgpu::MultisampleState::default(),
            fragment: Some(fragment_state(&shader, &[Some(wgpu::TextureFormat::R8Unorm.into())])),
            multiview_mask: None,
            cache: None,
        });
        let view = gpu.buffer(bytemuck::bytes_of(&ViewUniform::new(&rays)), wgpu::BufferUsages::UNIFORM);
        let [white, black] = setup.beam.window;
        let beam = BeamUniform {
            mu_tissue: setup.beam.mu_tissue as f32,
            mu_lumen: setup.beam.mu_lumen as f32,
            tissue_mm: setup.beam.tissue_mm as f32,
            white: white as f32,
            span: (black - white) as f32,
            subrays: SUBRAYS,
            padding: [0.0; 2],
        };
        let beam = gpu.buffer(bytemuck::bytes_of(&beam), wgpu::BufferUsages::UNIFORM);
        let [lumen, excess] =
            [0, 1].map(|_| gpu.target(rays.size_px(), PATH_FORMAT, 1).create_view(&Default::default()));
        let resolve_group = gpu.bind(
            &resolve,
            &[
                view.as_entire_binding(),
                beam.as_entire_binding(),
                wgpu::BindingResource::TextureView(&lumen),
                wgpu::BindingResource::TextureView(&excess),
            ],
        );
        let picture = gpu.target(setup.c_arm.size_px(), wgpu::TextureFormat::R8Unorm, 1);
        let fluoro = Self {
            gpu: gpu.clone(),
            setup: setup.clone(),
            rays,
            wall,
            draw_wall,
            draw_pieces,
            resolve,
            view,
            resolve_group,
            excess,
            picture,
        };
        // The vessel does not move: its path lengths are drawn once.
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        fluoro.encode_wall(&mut encoder, &lumen, &fluoro.view);
        gpu.queue.submit([encoder.finish()]);
        fluoro
    }

    fn encode_wall(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        target: &wgpu::TextureView,
        view: &wgpu::Buffer,
    ) {
        let group = self.gpu.bind(&self.draw_wall, &[view.as_entire_binding()]);
        let mut pass = color_pass(encoder, target, wgpu::Color::TRANSPARENT);
        pass.set_pipeline(&self.draw_wall);
        pass.set_bind_group(0, &group, &[]);
        pass.set_vertex_buffer(0, self.wall.slice(..));
        pass.draw(0..(self.wall.size() / size_of::<WallVertex>() as u64) as u32, 0..1);
    }

    fn encode_pieces(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        target: &wgpu::TextureView,
        view: &wgpu::Buffer,
        pieces: &[PieceInstance],
    ) {
        let group = self.gpu.bind(&self.draw_pieces, &[view.as_entire_binding()]);
        let instances = (!pieces.is_empty())
            .then(|| self.gpu.buffer(bytemuck::cast_slice(pieces), wgpu::BufferUsages::VERTEX));
        let mut pass = color_pass(encoder, target, wgpu::Color::TRANSPARENT);
        if let Some(instances) = &instances {
            pass.set_pipeline(&self.draw_pieces);
            pass.set_bind_group(0, &group, &[]);
            pass.set_vertex_buffer(0, instances.slice(..));
            pass.draw(0..6, 0..pieces.len() as u32);
        }
    }

    /// Reads back what `encode` draws with one ray a pixel.
    fn path(
        &self,
        encode: impl Fn(&mut wgpu::CommandEncoder, &wgpu::TextureView, &wgpu::Buffer),
    ) -> Result<Vec<f32>> {
        let Self { gpu, setup, .. } = self;
        let target = gpu.target(setup.c_arm.size_px(), PATH_FORMAT, 1);
        let uniform = ViewUniform::new(&setup.c_arm);
        let view = gpu.buffer(bytemuck::bytes_of(&uniform), wgpu::BufferUsages::UNIFORM);
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        encode(&mut encoder, &target.create_view(&Default::default()), &view);
        let data = gpu.read_back(encoder, &target)?;
        Ok(bytemuck::pod_collect_to_vec(&data))
    }
}

impl FluoroEngine for GpuFluoro {
    fn frame(&mut self, devices: &[RefinedDevice]) -> Result<Image> {
        let Self { gpu, setup, .. } = &*self;
        let mut instances = Vec::new();
        for device in devices {
            let weight = setup.beam.device_excess_per_mm(device.material)?;
            let pieces = pieces_in_beam(&self.rays, &device.points);
            instances.extend(pieces.iter().map(|piece| instance(&self.rays, piece, weight)));
        }
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        self.encode_pieces(&mut encoder, &self.excess, &self.view, &instances);
        {
            let target = self.picture.create_view(&Default::default());
            let mut pass = color_pass(&mut encoder, &target, wgpu::Color::BLACK);
            pass.set_pipeline(&self.resolve);
            pass.set_bind_group(0, &self.resolve_group, &[]);
            pass.draw(0..3, 0..1);
        }
        let data = gpu.read_back(encoder, &self.picture)?;
        let [width, height] = setup.c_arm.size_px();
        Ok(Image::new(width, height, PixelFormat::Gray8, data))
    }

    fn lumen_path(&mut self) -> Result<Vec<f32>> {
        self.path(|encoder, target, view| self.encode_wall(encoder, target, view))
    }

    fn device_path(&mut self, device: &RefinedDevice) -> Result<Vec<f32>> {
        let c_arm = &self.setup.c_arm;
        let pieces = pieces_in_beam(c_arm, &device.points);
        let instances: Vec<PieceInstance> = pieces.iter().map(|piece| instance(c_arm, piece, 1.0)).collect();
        self.path(|encoder, target, view| self.encode_pieces(encoder, target, view, &instances))
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

fn instance(c_arm: &CArm, piece: &Piece, weight: f64) -> PieceInstance {
    let [columns, rows] = pixels_of(c_arm, piece);
    let four = |v: &endowire_core::Vec3, w: f64| [v.x, v.y, v.z, w].map(|x| x as f32);
    PieceInstance {
        rectangle: [columns.start, rows.start, columns.end, rows.end].map(|n| n as f32),
        start_radius: four(&piece.start, piece.radius),
        axis_slope: four(&piece.axis, piece.slope),
        planes: [0, 1].map(|k| four(&piece.planes[k], piece.offsets[k])),
        weight: weight as f32,
    }
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
