//! Normals and colours of a tile while its rays lie on the GPU.
//!
//! Twin: `sdfrs_trace::shade`. Law (tests/parity.rs): the same colours within 1/255 where the hits agree.

use sdfrs_core::Control;
use sdfrs_trace::shade::{PointLight, Surface, direct::DIRECT};

use crate::{
    buffers::{self, Reader, Use},
    compiled::Compiled,
    contract::{Light, Params, Shaded},
    device::Device,
    dispatch::{Dispatcher, Ready, tell},
    error::GpuError,
    march::Traced,
    pipelines::Binding,
    share::{Share, Shares},
};

/// What the pass sees in group 0, in order: Params, rays, tallies, lights, shaded.
const GROUP: [Binding; 5] =
    [Binding::Uniform, Binding::Read, Binding::Read, Binding::Read, Binding::ReadWrite];

/// The modules of the pass, by name.
pub fn modules(source: &'static str, patched: bool) -> [&'static str; 8] {
    let field = if patched { "field/patches" } else { "field/whole" };
    ["contract", "number", source, "source/pair", field, "shade/normal", "shade/direct", "pass/shade"]
}

/// The shading of a scene, compiled.
pub struct Shader<'a> {
    device: &'a Device,
    scene: &'a Compiled,
    source: &'static str,
    lights: wgpu::Buffer,
    albedo: [f32; 3],
    background: u32,
    shares: Shares,
    /// Bound to the first tile's memory, which the others share.
    memory: Option<Memory>,
}

struct Memory {
    ready: Ready,
    shaded: wgpu::Buffer,
    reader: Reader,
}

impl<'a> Shader<'a> {
    pub fn new(
        device: &'a Device,
        scene: &'a Compiled,
        source: &'static str,
        lights: &[PointLight],
        surface: &Surface,
    ) -> Result<Self, GpuError> {
        let mut lamps: Vec<Light> = lights.iter().map(lamp).collect();
        if lamps.is_empty() {
            // A binding cannot be empty; this one shines black.
            lamps.push(Light::default());
        }
        let [r, g, b] = surface.background.map(|v| (v * 255.0 + 0.5) as u32);
        Ok(Self {
            device,
            scene,
            source,
            lights: buffers::upload(device, "lights", bytemuck::cast_slice(&lamps), Use::Storage)?,
            albedo: surface.albedo.map(|v| v as f32),
            background: r | (g << 8) | (b << 16),
            // A gradient is worth four evaluations.
            shares: Shares::new(scene.ops().saturating_mul(4)),
            memory: None,
        })
    }

    /// Shades all rays of a tile.
    pub fn tile(
        &mut self,
        traced: &Traced<'_>,
        dispatcher: &mut Dispatcher<'_>,
        control: &Control,
        normals: &mut [[f32; 3]],
        rgb: &mut [[u8; 3]],
    ) -> Result<(), GpuError> {
        let rays = traced.params.rays;
        let memory = match self.memory.take() {
            Some(memory) => memory,
            None => self.bind(traced)?,
        };
        let mut first = 0;
        while first < rays {
            let share = self.shares.share(rays - first);
            let (albedo, background) = (self.albedo, self.background);
            let now = Params { first, count: share.rays, albedo, background, ..traced.params };
            tell(self.device, traced.uniform, &now)?;
            let cost =
                dispatcher.run(&memory.ready, share.rays, &memory.reader, &memory.shaded, 16, |_| ())?;
            self.shares.learn(Share { steps: 1, ..share }, false, cost);
            first += share.rays;
        }
        let bytes = u64::from(rays) * size_of::<Shaded>() as u64;
        let mut encoder = self.device.raw().create_command_encoder(&Default::default());
        memory.reader.copy(&mut encoder, &memory.shaded, bytes);
        let submission = self.device.submit(encoder)?;
        memory.reader.read(self.device, submission, control, bytes, |bytes| {
            let pixels = bytemuck::cast_slice::<u8, Shaded>(bytes);
            for ((pixel, normal), rgb) in pixels.iter().zip(normals).zip(rgb) {
                *normal = pixel.normal;
                let [r, g, b, _] = pixel.rgb.to_le_bytes();
                *rgb = [r, g, b];
            }
        })?;
        self.memory = Some(memory);
        Ok(())
    }

    /// Memory for the first tile, which is the largest.
    fn bind(&self, traced: &Traced<'_>) -> Result<Memory, GpuError> {
        let bytes = u64::from(traced.params.rays) * size_of::<Shaded>() as u64;
        let shaded = buffers::make(self.device, "pixels", bytes, Use::Storage)?;
        let modules = modules(self.source, self.scene.patches().is_some());
        let own = [traced.uniform, traced.rays, traced.tallies, &self.lights, &shaded];
        let ready = self.scene.field().ready(self.device, &modules, "shade_pass", &GROUP, &own)?;
        Ok(Memory { ready, shaded, reader: Reader::new(self.device, bytes)? })
    }
}

fn lamp(light: &PointLight) -> Light {
    Light {
        position: light.position.map(|v| v as f32),
        color: light.color.map(|c| (c * DIRECT * light.intensity) as f32),
        ..Light::default()
    }
}
