//! An adapter, its device and queue, and reading back pixels.
//!
//! wgpu reports most failures outside the call that caused them and panics without a handler. Here a handler stores
//! the first report, and every read-back returns it as an error: a failing adapter costs a frame, never the program.

use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use endowire_core::{Error, Result};
use futures_channel::oneshot;

use crate::engine::process;
use crate::gpu::view3d::Pipelines;

/// The first failure an adapter has reported.
type Failure = Arc<Mutex<Option<String>>>;

/// Open devices: opening one takes a driver a fifth of a second, and each pose of a dataset requests one.
static OPENED: Pool = Pool(Mutex::new(Vec::new()));

/// A pool of devices, each lent to one user at a time: waiting for a device waits for all of its work.
struct Pool(Mutex<Vec<Gpu>>);

impl Pool {
    /// A device that is not in use and has not failed.
    fn free(&self, features: wgpu::Features, software: bool) -> Option<Gpu> {
        let mut all = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        all.retain(|gpu| gpu.check().is_ok());
        let fits = |gpu: &&Gpu| {
            let has = gpu.device.features().contains(features);
            Arc::strong_count(&gpu.paths) == 1 && has && (software || !gpu.is_software)
        };
        all.iter().find(fits).cloned()
    }

    /// Adds an opened device.
    fn keep(&self, gpu: &Gpu) {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).push(gpu.clone());
    }
}

/// An open graphics device; clones share it.
#[derive(Debug, Clone)]
pub(crate) struct Gpu {
    pub(crate) device: wgpu::Device,
    pub(crate) queue: wgpu::Queue,
    /// Largest number of pixels per side that it supports.
    pub(crate) largest_side: u32,
    /// Pipelines of fluoroscopy and of the 3D view, created when first used: compiling them takes a driver some time.
    pub(crate) paths: Arc<OnceLock<wgpu::RenderPipeline>>,
    pub(crate) three_d: Arc<OnceLock<Pipelines>>,
    is_software: bool,
    name: String,
    failure: Failure,
}

impl Gpu {
    /// The best adapter that has `features`: discrete before integrated before others; software adapters last, and
    /// only if `software` allows them. An open device that is not in use is preferred.
    ///
    /// # Errors
    /// Why there is none, as a clause.
    pub(crate) fn open(features: wgpu::Features, software: bool) -> std::result::Result<Self, String> {
        if cfg!(target_family = "wasm") {
            return Err("a browser's graphics answer later: give Graphics to what waits for it".into());
        }
        check_process()?;
        if let Some(gpu) = OPENED.free(features, software) {
            return Ok(gpu);
        }
        let gpu = pollster::block_on(Self::request(features, software))?;
        OPENED.keep(&gpu);
        Ok(gpu)
    }

    /// Opens one asynchronously.
    ///
    /// # Errors
    /// As [`Self::open`].
    pub(crate) async fn request(
        features: wgpu::Features,
        software: bool,
    ) -> std::result::Result<Self, String> {
        check_process()?;
        let descriptor = wgpu::InstanceDescriptor {
            flags: wgpu::InstanceFlags::empty(),
            ..wgpu::InstanceDescriptor::new_without_display_handle()
        };
        let instance = wgpu::Instance::new(descriptor);
        let mut adapters = instance.enumerate_adapters(wgpu::Backends::all()).await;
        let is_software = |a: &wgpu::Adapter| a.get_info().device_type == wgpu::DeviceType::Cpu;
        if !software && !adapters.is_empty() && adapters.iter().all(is_software) {
            let name = adapters[0].get_info().name;
            return Err(format!("{name} draws on the processor too, and slower"));
        }
        adapters.retain(|a| software || !is_software(a));
        if adapters.is_empty() {
            return Err("no graphics adapter was found".into());
        }
        adapters.retain(|a| a.features().contains(features));
        let Some(adapter) = adapters.into_iter().min_by_key(|a| match a.get_info().device_type {
            wgpu::DeviceType::DiscreteGpu => 0,
            wgpu::DeviceType::IntegratedGpu => 1,
            wgpu::DeviceType::VirtualGpu => 2,
            wgpu::DeviceType::Other => 3,
            wgpu::DeviceType::Cpu => 4,
        }) else {
            return Err(format!("no graphics adapter offers {features:?}"));
        };
        let info = adapter.get_info();
        // With the features for fluoroscopy, even if only the 3D view requests it: one device serves both.
        let features = features | (adapter.features() & wgpu::Features::FLOAT32_BLENDABLE);
        let request = adapter.request_device(&wgpu::DeviceDescriptor {
            label: Some("endowire"),
            required_features: features,
            required_limits: adapter.limits(),
            ..Default::default()
        });
        let (device, queue) = request.await.map_err(|e| format!("{}: {e}", info.name))?;
        let failure = Failure::default();
        let report = |failure: &Failure, text: String| {
            failure.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(text);
        };
        let heard = failure.clone();
        device.on_uncaptured_error(Arc::new(move |error: wgpu::Error| report(&heard, error.to_string())));
        let heard = failure.clone();
        device.set_device_lost_callback(move |reason, text| {
            report(&heard, format!("the device was lost ({reason:?}) {text}"));
        });
        let largest_side = device.limits().max_texture_dimension_2d;
        let name = match info.backend {
            // A browser does not reveal the adapter's name.
            wgpu::Backend::BrowserWebGpu => "WebGPU".to_owned(),
            backend => format!("{backend:?} {}", info.name),
        };
        let is_software = info.device_type == wgpu::DeviceType::Cpu;
        let (paths, three_d) = Default::default();
        Ok(Self { device, queue, largest_side, paths, three_d, is_software, name, failure })
    }

    /// Graphics interface and adapter.
    pub(crate) fn name(&self) -> &str {
        &self.name
    }

    /// The adapter's first failure report, as an error.
    pub(crate) fn check(&self) -> Result<()> {
        match self.failure.lock().unwrap_or_else(PoisonError::into_inner).as_ref() {
            Some(text) => Err(Error::Computation(text.clone())),
            None => Ok(()),
        }
    }

    /// A buffer of these bytes, a multiple of four. Written by the queue: a buffer created with contents is mapped,
    /// which panics if the device is lost.
    pub(crate) fn buffer(&self, contents: &[u8], usage: wgpu::BufferUsages) -> wgpu::Buffer {
        let buffer = self.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("endowire"),
            size: contents.len() as u64,
            usage: usage | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        self.queue.write_buffer(&buffer, 0, contents);
        buffer
    }

    /// A texture that is rendered to, then sampled or copied.
    pub(crate) fn target(&self, size: [u32; 2], format: wgpu::TextureFormat, samples: u32) -> wgpu::Texture {
        let mut usage = wgpu::TextureUsages::RENDER_ATTACHMENT;
        if samples == 1 {
            usage |= wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_SRC;
        }
        self.device.create_texture(&wgpu::TextureDescriptor {
            label: None,
            size: wgpu::Extent3d { width: size[0], height: size[1], depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count: samples,
            dimension: wgpu::TextureDimension::D2,
            format,
            usage,
            view_formats: &[],
        })
    }

    pub(crate) fn shader(&self, source: &'static str) -> wgpu::ShaderModule {
        self.device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: None,
            source: wgpu::ShaderSource::Wgsl(source.into()),
        })
    }

    /// A bind group of a pipeline's group 0, with the resources at bindings 0, 1, ….
    pub(crate) fn bind(
        &self,
        pipeline: &wgpu::RenderPipeline,
        resources: &[wgpu::BindingResource<'_>],
    ) -> wgpu::BindGroup {
        let entries: Vec<wgpu::BindGroupEntry<'_>> = (0..)
            .zip(resources)
            .map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource: resource.clone() })
            .collect();
        let layout = pipeline.get_bind_group_layout(0);
        let descriptor = wgpu::BindGroupDescriptor { label: None, layout: &layout, entries: &entries };
        self.device.create_bind_group(&descriptor)
    }

    /// Submits `encoder`; returns the read-back of `texture` after it.
    pub(crate) fn submit(
        &self,
        mut encoder: wgpu::CommandEncoder,
        texture: &wgpu::Texture,
    ) -> Result<Reading> {
        let size = texture.size();
        let row = size.width * texture.format().block_copy_size(None).unwrap_or(4);
        let padded = row.next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
        let buffer = self.device.create_buffer(&wgpu::BufferDescriptor {
            label: None,
            size: u64::from(padded) * u64::from(size.height),
            usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
            mapped_at_creation: false,
        });
        let layout =
            wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(padded), rows_per_image: None };
        encoder.copy_texture_to_buffer(
            texture.as_image_copy(),
            wgpu::TexelCopyBufferInfo { buffer: &buffer, layout },
            size,
        );
        self.queue.submit([encoder.finish()]);
        self.check()?;
        Ok(Reading { gpu: self.clone(), buffer, row: row as usize, padded: padded as usize })
    }
}

/// Drivers have threads and locks that a forked process lacks: waiting for them would never end.
///
/// # Errors
/// If this process was forked from one that has used graphics.
fn check_process() -> std::result::Result<(), String> {
    static PROCESS: OnceLock<u32> = OnceLock::new();
    if *PROCESS.get_or_init(process) == process() {
        return Ok(());
    }
    Err("graphics were in use before this process was forked".into())
}

/// A texture being read back.
#[derive(Debug)]
pub(crate) struct Reading {
    gpu: Gpu,
    buffer: wgpu::Buffer,
    /// Bytes of a row, and with its padding.
    row: usize,
    padded: usize,
}

impl Reading {
    /// Its bytes, rows without padding.
    ///
    /// # Errors
    /// The adapter's failure report.
    pub(crate) async fn bytes(self) -> Result<Vec<u8>> {
        let Self { gpu, buffer, row, padded } = self;
        let failed = |what: &str| Error::Computation(format!("reading a frame back: {what}"));
        let (sender, receiver) = oneshot::channel();
        // The receiver outlives the callback unless this has returned with an error; then nobody waits.
        buffer.map_async(wgpu::MapMode::Read, .., move |result| drop(sender.send(result)));
        // A browser polls by itself.
        gpu.device.poll(wgpu::PollType::wait_indefinitely()).map_err(|e| failed(&e.to_string()))?;
        match receiver.await {
            Ok(Ok(())) => {}
            Ok(Err(error)) => return Err(failed(&error.to_string())),
            Err(_) => return Err(failed("the adapter did not answer")),
        }
        gpu.check()?;
        let mapped = buffer.get_mapped_range(..).map_err(|e| failed(&e.to_string()))?;
        let mut data = Vec::with_capacity(mapped.len() / padded * row);
        mapped.chunks_exact(padded).for_each(|line| data.extend_from_slice(&line[..row]));
        Ok(data)
    }
}

/// A render pass over one texture that starts from `clear`, or from the existing content.
pub(crate) fn color_pass<'a>(
    encoder: &'a mut wgpu::CommandEncoder,
    view: &wgpu::TextureView,
    clear: wgpu::Color,
) -> wgpu::RenderPass<'a> {
    encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        color_attachments: &[Some(attachment(view, None, clear))],
        ..Default::default()
    })
}

/// A colour attachment that starts from `clear`; with a `resolve` target only the resolved texture is kept.
pub(crate) fn attachment<'a>(
    view: &'a wgpu::TextureView,
    resolve_target: Option<&'a wgpu::TextureView>,
    clear: wgpu::Color,
) -> wgpu::RenderPassColorAttachment<'a> {
    let store = if resolve_target.is_some() { wgpu::StoreOp::Discard } else { wgpu::StoreOp::Store };
    let ops = wgpu::Operations { load: wgpu::LoadOp::Clear(clear), store };
    wgpu::RenderPassColorAttachment { view, depth_slice: None, resolve_target, ops }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    /// A separate adapter. Without one: a failure if ENDOWIRE_REQUIRE_GPU=1 demands it, otherwise `None` and a
    /// message.
    pub(crate) fn opened() -> Option<Gpu> {
        match pollster::block_on(Gpu::request(wgpu::Features::FLOAT32_BLENDABLE, true)) {
            Ok(gpu) => Some(gpu),
            Err(reason) => {
                let required = std::env::var("ENDOWIRE_REQUIRE_GPU").is_ok_and(|v| v == "1");
                assert!(!required, "ENDOWIRE_REQUIRE_GPU=1, but {reason}");
                eprintln!("skipped: {reason}");
                None
            }
        }
    }

    #[test]
    fn an_open_device_is_for_one_after_the_other_until_it_fails() {
        let Some(gpu) = opened() else { return };
        let pool = Pool(Mutex::default());
        pool.keep(&gpu);
        let features = wgpu::Features::FLOAT32_BLENDABLE;
        assert!(pool.free(features, true).is_none(), "somebody has it");
        let failure = gpu.failure.clone();
        drop(gpu);
        let next = pool.free(features, true).unwrap();
        assert!(Arc::ptr_eq(&next.failure, &failure));
        assert!(pool.free(features, true).is_none());
        drop(next);
        assert!(pool.free(features, true).is_some());
        failure.lock().unwrap().replace("it was lost".into());
        assert!(pool.free(features, true).is_none());
    }

    #[test]
    fn a_destroyed_device_gives_an_error_and_no_panic() {
        let Some(gpu) = opened() else { return };
        let read = || {
            let texture = gpu.target([8, 8], wgpu::TextureFormat::R8Unorm, 1);
            let mut encoder = gpu.device.create_command_encoder(&Default::default());
            let view = texture.create_view(&Default::default());
            drop(color_pass(&mut encoder, &view, wgpu::Color::WHITE));
            pollster::block_on(gpu.submit(encoder, &texture)?.bytes())
        };
        assert_eq!(read().unwrap(), [255; 64]);
        gpu.device.destroy();
        assert!(matches!(read(), Err(Error::Computation(_))));
    }
}
