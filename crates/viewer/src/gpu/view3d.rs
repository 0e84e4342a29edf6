//! The 3D view through wgpu: devices with a depth buffer, then the wall in any order, then both together.

use endowire_core::Result;
use endowire_core::vessel::SurfaceMesh;

use crate::engine::ThreeDEngine;
use crate::gpu::context::{Gpu, Reading, attachment, color_pass};
use crate::output::{Image, PixelFormat};
use crate::three_d::{Camera, Solids, Style, Vertex, solid_triangles, wall_triangles};

/// The only sample count supported by every adapter.
const SAMPLES: u32 = 4;
const COLOUR: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8Unorm;
const DEPTH: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;
/// Weighted sum of colours and weights.
const SUM: wgpu::TextureFormat = wgpu::TextureFormat::Rgba16Float;
/// Product of the fragments' transparencies.
const THROUGH: wgpu::TextureFormat = wgpu::TextureFormat::R16Float;

/// Pipelines for any wall and camera.
#[derive(Debug, Clone)]
pub(crate) struct Pipelines {
    device: wgpu::RenderPipeline,
    wall: wgpu::RenderPipeline,
    compose: wgpu::RenderPipeline,
}

impl Pipelines {
    fn new(gpu: &Gpu) -> Self {
        let shader = gpu.shader(include_str!("view3d.wgsl"));
        let [device, wall, compose] =
            [Stage::Device, Stage::Wall, Stage::Compose].map(|stage| pipeline(gpu, &shader, stage));
        Self { device, wall, compose }
    }
}

/// Pipelines, wall and targets of the 3D view.
#[derive(Debug)]
pub(crate) struct GpuView3d {
    gpu: Gpu,
    pipelines: Pipelines,
    camera: Camera,
    background: wgpu::Color,
    wall: wgpu::Buffer,
    device_group: wgpu::BindGroup,
    wall_group: wgpu::BindGroup,
    compose_group: wgpu::BindGroup,
    /// Multisampled colour, depth, sum and product.
    sampled: [wgpu::TextureView; 4],
    /// Resolved colour, sum and product.
    resolved: [wgpu::TextureView; 3],
    picture: wgpu::Texture,
}

impl GpuView3d {
    pub(crate) fn new(gpu: &Gpu, camera: &Camera, wall: &SurfaceMesh) -> Self {
        let pipelines = gpu.three_d.get_or_init(|| Pipelines::new(gpu));
        let style = Style::new(camera);
        let uniform = gpu.buffer(bytemuck::cast_slice(&style.uniform()), wgpu::BufferUsages::UNIFORM);
        let vertices = wall_triangles(camera, wall);
        let wall = gpu.buffer(bytemuck::cast_slice(&vertices), wgpu::BufferUsages::VERTEX);
        let view =
            |format, samples| gpu.target(camera.size_px, format, samples).create_view(&Default::default());
        let sampled = [COLOUR, DEPTH, SUM, THROUGH].map(|format| view(format, SAMPLES));
        let resolved = [COLOUR, SUM, THROUGH].map(|format| view(format, 1));
        let device_group = gpu.bind(&pipelines.device, &[uniform.as_entire_binding()]);
        let wall_group = gpu.bind(&pipelines.wall, &[uniform.as_entire_binding()]);
        let compose_group = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: None,
            layout: &pipelines.compose.get_bind_group_layout(0),
            entries: &[1, 2, 3].map(|binding| wgpu::BindGroupEntry {
                binding,
                resource: wgpu::BindingResource::TextureView(&resolved[binding as usize - 1]),
            }),
        });
        let [r, g, b] = style.background().to_array().map(f64::from);
        Self {
            gpu: gpu.clone(),
            pipelines: pipelines.clone(),
            camera: camera.clone(),
            background: wgpu::Color { r, g, b, a: 1.0 },
            wall,
            device_group,
            wall_group,
            compose_group,
            sampled,
            resolved,
            picture: gpu.target(camera.size_px, COLOUR, 1),
        }
    }

    /// Draws a frame; returns its read-back.
    pub(crate) fn submit(&self, solids: &Solids) -> Result<Reading> {
        let mut encoder = self.gpu.device.create_command_encoder(&Default::default());
        self.draw_devices(&mut encoder, &solid_triangles(&self.camera, solids));
        self.draw_wall(&mut encoder);
        let target = self.picture.create_view(&Default::default());
        let mut pass = color_pass(&mut encoder, &target, wgpu::Color::BLACK);
        pass.set_pipeline(&self.pipelines.compose);
        pass.set_bind_group(0, &self.compose_group, &[]);
        pass.draw(0..3, 0..1);
        drop(pass);
        self.gpu.submit(encoder, &self.picture)
    }

    fn draw_devices(&self, encoder: &mut wgpu::CommandEncoder, vertices: &[Vertex]) {
        let [colour, depth, ..] = &self.sampled;
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("devices"),
            color_attachments: &[Some(attachment(colour, Some(&self.resolved[0]), self.background))],
            depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                view: depth,
                depth_ops: Some(wgpu::Operations {
                    load: wgpu::LoadOp::Clear(1.0),
                    store: wgpu::StoreOp::Store,
                }),
                stencil_ops: None,
            }),
            ..Default::default()
        });
        if !vertices.is_empty() {
            let buffer = self.gpu.buffer(bytemuck::cast_slice(vertices), wgpu::BufferUsages::VERTEX);
            pass.set_pipeline(&self.pipelines.device);
            pass.set_bind_group(0, &self.device_group, &[]);
            pass.set_vertex_buffer(0, buffer.slice(..));
            pass.draw(0..vertices.len() as u32, 0..1);
        }
    }

    fn draw_wall(&self, encoder: &mut wgpu::CommandEncoder) {
        let [_, depth, sum, through] = &self.sampled;
        let [_, resolved_sum, resolved_through] = &self.resolved;
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("wall"),
            color_attachments: &[
                Some(attachment(sum, Some(resolved_sum), wgpu::Color::TRANSPARENT)),
                Some(attachment(through, Some(resolved_through), wgpu::Color::WHITE)),
            ],
            // Without operations the depth buffer is only read.
            depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                view: depth,
                depth_ops: None,
                stencil_ops: None,
            }),
            ..Default::default()
        });
        pass.set_pipeline(&self.pipelines.wall);
        pass.set_bind_group(0, &self.wall_group, &[]);
        pass.set_vertex_buffer(0, self.wall.slice(..));
        pass.draw(0..(self.wall.size() / size_of::<Vertex>() as u64) as u32, 0..1);
    }

    /// The image that was read back.
    pub(crate) fn image(camera: &Camera, data: Vec<u8>) -> Image {
        Image::new(camera.size_px[0], camera.size_px[1], PixelFormat::Rgba8, data)
    }
}

impl ThreeDEngine for GpuView3d {
    fn frame(&mut self, solids: &Solids) -> Result<Image> {
        let data = pollster::block_on(self.submit(solids)?.bytes())?;
        Ok(Self::image(&self.camera, data))
    }
}

/// What a pipeline draws.
#[derive(Clone, Copy, PartialEq)]
enum Stage {
    Device,
    Wall,
    Compose,
}

fn pipeline(gpu: &Gpu, shader: &wgpu::ShaderModule, stage: Stage) -> wgpu::RenderPipeline {
    let (vertex, fragment) = match stage {
        Stage::Device => ("surface", "device"),
        Stage::Wall => ("surface", "wall"),
        Stage::Compose => ("everywhere", "compose"),
    };
    let blended = |format, src_factor, dst_factor| {
        let component = wgpu::BlendComponent { src_factor, dst_factor, operation: wgpu::BlendOperation::Add };
        let blend = Some(wgpu::BlendState { color: component, alpha: component });
        Some(wgpu::ColorTargetState { format, blend, write_mask: wgpu::ColorWrites::ALL })
    };
    let targets = match stage {
        Stage::Wall => vec![
            blended(SUM, wgpu::BlendFactor::One, wgpu::BlendFactor::One),
            blended(THROUGH, wgpu::BlendFactor::Zero, wgpu::BlendFactor::Src),
        ],
        Stage::Device | Stage::Compose => vec![Some(COLOUR.into())],
    };
    let layout = wgpu::VertexBufferLayout {
        array_stride: size_of::<Vertex>() as u64,
        step_mode: wgpu::VertexStepMode::Vertex,
        attributes: &wgpu::vertex_attr_array![0 => Float32x3, 1 => Float32x3, 2 => Unorm8x4],
    };
    let surface = stage != Stage::Compose;
    let buffers = [Some(layout)];
    gpu.device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some(fragment),
        layout: None,
        vertex: wgpu::VertexState {
            module: shader,
            entry_point: Some(vertex),
            compilation_options: Default::default(),
            buffers: if surface { &buffers } else { &[] },
        },
        primitive: wgpu::PrimitiveState::default(),
        depth_stencil: surface.then(|| wgpu::DepthStencilState {
            format: DEPTH,
            depth_write_enabled: Some(stage == Stage::Device),
            depth_compare: Some(wgpu::CompareFunction::Less),
            stencil: Default::default(),
            bias: Default::default(),
        }),
        multisample: wgpu::MultisampleState {
            count: if surface { SAMPLES } else { 1 },
            ..Default::default()
        },
        fragment: Some(wgpu::FragmentState {
            module: shader,
            entry_point: Some(fragment),
            compilation_options: Default::default(),
            targets: &targets,
        }),
        multiview_mask: None,
        cache: None,
    })
}
