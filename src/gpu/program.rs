//! Pipelines with layouts from reflection, and the fixed set of samplers.

use std::sync::Arc;

use ash::vk;

use super::context::{Gpu, Shared, device_error, lock};
use super::memory::Retired;
use super::{Binding, Shader};
use crate::{Error, Result};

/// How a texture is sampled.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sampler {
    /// No filtering; clamps to the edge.
    Nearest,
    /// No filtering; repeats.
    NearestRepeat,
    /// Bilinear within the nearest mip level; clamps to the edge.
    Linear,
    /// Bilinear within the nearest mip level; transparent black outside.
    LinearBorder,
    /// Bilinear within the nearest mip level; repeats.
    LinearRepeat,
    /// Bilinear, and linear between mip levels; clamps to the edge.
    Trilinear,
}

impl Sampler {
    pub(super) const ALL: [Sampler; 6] = [
        Sampler::Nearest,
        Sampler::NearestRepeat,
        Sampler::Linear,
        Sampler::LinearBorder,
        Sampler::LinearRepeat,
        Sampler::Trilinear,
    ];

    pub(super) fn make(self, device: &ash::Device) -> std::result::Result<vk::Sampler, vk::Result> {
        let filter = match self {
            Sampler::Nearest | Sampler::NearestRepeat => vk::Filter::NEAREST,
            _ => vk::Filter::LINEAR,
        };
        let address = match self {
            Sampler::LinearBorder => vk::SamplerAddressMode::CLAMP_TO_BORDER,
            Sampler::LinearRepeat | Sampler::NearestRepeat => vk::SamplerAddressMode::REPEAT,
            _ => vk::SamplerAddressMode::CLAMP_TO_EDGE,
        };
        let create = vk::SamplerCreateInfo::default()
            .mag_filter(filter)
            .min_filter(filter)
            .mipmap_mode(if self == Sampler::Trilinear {
                vk::SamplerMipmapMode::LINEAR
            } else {
                vk::SamplerMipmapMode::NEAREST
            })
            .address_mode_u(address)
            .address_mode_v(address)
            .address_mode_w(vk::SamplerAddressMode::CLAMP_TO_EDGE)
            .max_lod(vk::LOD_CLAMP_NONE)
            .border_color(vk::BorderColor::FLOAT_TRANSPARENT_BLACK);
        // SAFETY: the device is alive.
        unsafe { device.create_sampler(&create, None) }
    }
}

/// A pipeline and what binding to it needs.
pub struct Program {
    shared: Arc<Shared>,
    name: &'static str,
    pub(super) pipeline: vk::Pipeline,
    pub(super) layout: vk::PipelineLayout,
    pub(super) set: vk::DescriptorSetLayout,
    pub(super) bindings: Vec<Binding>,
    pub(super) stages: vk::ShaderStageFlags,
    pub(super) push_bytes: u32,
    pub(super) bind_point: vk::PipelineBindPoint,
}

/// How depth is tested.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DepthTest {
    /// No depth buffer.
    None,
    /// Nearer wins; reverse Z, so nearer is greater. Writes depth.
    Reverse,
}

/// A graphics pipeline; it draws triangles, whose colours replace what was there.
#[derive(Clone, Copy, Debug)]
pub struct GraphicsDesc<'a> {
    /// Vertex shader.
    pub vert: &'static Shader,
    /// Fragment shader.
    pub frag: &'static Shader,
    /// Colour attachment formats.
    pub colors: &'a [vk::Format],
    /// Samples a pixel.
    pub samples: u32,
    /// Depth test; the depth buffer is D32.
    pub depth: DepthTest,
    /// Every specialization constant of the two shaders by name, and the 32 bits of its value.
    pub constants: &'a [(&'a str, u32)],
}

impl Gpu {
    /// A compute pipeline; with every specialization constant of the shader by name, and the 32 bits of its value.
    ///
    /// # Errors
    /// [`Error::Usage`] for a constant that the shader does not have, or one of its own that is missing;
    /// [`Error::Device`] if the driver refuses it.
    pub fn compute(&self, shader: &'static Shader, constants: &[(&str, u32)]) -> Result<Program> {
        check_constants(&[shader], constants)?;
        let mut program = self.layouts(&[shader], vk::PipelineBindPoint::COMPUTE)?;
        let module = Module::new(&self.shared, shader)?;
        let (entries, data) = (specialization(shader, constants), values(constants));
        let special = vk::SpecializationInfo::default().map_entries(&entries).data(&data);
        let stage = vk::PipelineShaderStageCreateInfo::default()
            .stage(shader.stage)
            .module(module.handle)
            .name(c"main")
            .specialization_info(&special);
        let create = [vk::ComputePipelineCreateInfo::default().stage(stage).layout(program.layout)];
        let (s, none) = (&self.shared, vk::PipelineCache::null());
        let made = s.failures.memory().and_then(|()| {
            // SAFETY: module and layout are alive.
            unsafe { s.device.create_compute_pipelines(none, &create, None) }.map_err(|(_, e)| e)
        });
        program.pipeline = made.map_err(device_error(shader.name))?[0];
        self.shared.name(program.pipeline, shader.name);
        *lock(&self.shared.pipelines).entry(program.name).or_default() += 1;
        Ok(program)
    }

    /// A graphics pipeline.
    ///
    /// # Errors
    /// [`Error::Usage`] for a specialization constant that neither shader has, or one of theirs that is missing;
    /// [`Error::Device`] if the driver refuses it.
    pub fn graphics(&self, d: &GraphicsDesc) -> Result<Program> {
        check_constants(&[d.vert, d.frag], d.constants)?;
        let mut program = self.layouts(&[d.vert, d.frag], vk::PipelineBindPoint::GRAPHICS)?;
        let (vert, frag) = (Module::new(&self.shared, d.vert)?, Module::new(&self.shared, d.frag)?);
        let data = values(d.constants);
        let entries = [d.vert, d.frag].map(|s| specialization(s, d.constants));
        let [of_vert, of_frag] =
            entries.each_ref().map(|e| vk::SpecializationInfo::default().map_entries(e).data(&data));
        let stages = [(d.vert, &vert, &of_vert), (d.frag, &frag, &of_frag)].map(|(s, m, special)| {
            vk::PipelineShaderStageCreateInfo::default()
                .stage(s.stage)
                .module(m.handle)
                .name(c"main")
                .specialization_info(special)
        });
        let vertex_input = vk::PipelineVertexInputStateCreateInfo::default();
        let assembly = vk::PipelineInputAssemblyStateCreateInfo::default()
            .topology(vk::PrimitiveTopology::TRIANGLE_LIST);
        let viewport = vk::PipelineViewportStateCreateInfo::default().viewport_count(1).scissor_count(1);
        let raster = vk::PipelineRasterizationStateCreateInfo::default()
            .polygon_mode(vk::PolygonMode::FILL)
            .cull_mode(vk::CullModeFlags::NONE)
            .line_width(1.0);
        let multisample = vk::PipelineMultisampleStateCreateInfo::default()
            .rasterization_samples(vk::SampleCountFlags::from_raw(d.samples));
        let depth_on = d.depth == DepthTest::Reverse;
        let depth = vk::PipelineDepthStencilStateCreateInfo::default()
            .depth_test_enable(depth_on)
            .depth_write_enable(depth_on)
            .depth_compare_op(vk::CompareOp::GREATER_OR_EQUAL);
        let attachment =
            vk::PipelineColorBlendAttachmentState::default().color_write_mask(vk::ColorComponentFlags::RGBA);
        let attachments = vec![attachment; d.colors.len()];
        let blend = vk::PipelineColorBlendStateCreateInfo::default().attachments(&attachments);
        let dynamic = [vk::DynamicState::VIEWPORT, vk::DynamicState::SCISSOR];
        let dynamic = vk::PipelineDynamicStateCreateInfo::default().dynamic_states(&dynamic);
        let mut rendering = vk::PipelineRenderingCreateInfo::default().color_attachment_formats(d.colors);
        if depth_on {
            rendering = rendering.depth_attachment_format(vk::Format::D32_SFLOAT);
        }
        let create = [vk::GraphicsPipelineCreateInfo::default()
            .stages(&stages)
            .vertex_input_state(&vertex_input)
            .input_assembly_state(&assembly)
            .viewport_state(&viewport)
            .rasterization_state(&raster)
            .multisample_state(&multisample)
            .depth_stencil_state(&depth)
            .color_blend_state(&blend)
            .dynamic_state(&dynamic)
            .layout(program.layout)
            .push_next(&mut rendering)];
        let (s, none) = (&self.shared, vk::PipelineCache::null());
        let made = s.failures.memory().and_then(|()| {
            // SAFETY: modules, layout and every state struct are alive.
            unsafe { s.device.create_graphics_pipelines(none, &create, None) }.map_err(|(_, e)| e)
        });
        program.pipeline = made.map_err(device_error(d.frag.name))?[0];
        self.shared.name(program.pipeline, d.frag.name);
        *lock(&self.shared.pipelines).entry(program.name).or_default() += 1;
        Ok(program)
    }

    /// Descriptor set and pipeline layouts of these stages together; the pipeline is still null.
    fn layouts(&self, stages: &[&'static Shader], bind_point: vk::PipelineBindPoint) -> Result<Program> {
        let s = &self.shared;
        let mut bindings: Vec<(Binding, vk::ShaderStageFlags)> = Vec::new();
        for shader in stages {
            for b in shader.bindings {
                match bindings.iter_mut().find(|(known, _)| known.binding == b.binding) {
                    Some((known, flags)) if known.name == b.name && known.kind == b.kind => {
                        *flags |= shader.stage;
                    }
                    Some((known, _)) => {
                        return Err(Error::Usage(format!(
                            "{}: binding {} is \"{}\" here and \"{}\" in another stage",
                            shader.name, b.binding, b.name, known.name
                        )));
                    }
                    None => bindings.push((*b, shader.stage)),
                }
            }
        }
        let layout: Vec<_> = bindings
            .iter()
            .map(|(b, flags)| {
                vk::DescriptorSetLayoutBinding::default()
                    .binding(b.binding)
                    .descriptor_type(b.kind)
                    .descriptor_count(1)
                    .stage_flags(*flags)
            })
            .collect();
        let stage_flags = stages.iter().fold(vk::ShaderStageFlags::empty(), |f, s| f | s.stage);
        let push_bytes = stages.iter().map(|s| s.push_constant_bytes).max().unwrap_or(0);
        let ranges = [vk::PushConstantRange::default().stage_flags(stage_flags).offset(0).size(push_bytes)];
        // SAFETY: the device is alive; the set layout outlives the pipeline layout.
        unsafe {
            let pushed = match s.push {
                None => vk::DescriptorSetLayoutCreateFlags::empty(),
                Some(_) => vk::DescriptorSetLayoutCreateFlags::PUSH_DESCRIPTOR_KHR,
            };
            let create = vk::DescriptorSetLayoutCreateInfo::default().flags(pushed).bindings(&layout);
            let free = s.failures.memory();
            let set = free
                .and_then(|()| s.device.create_descriptor_set_layout(&create, None))
                .map_err(device_error("descriptor set layout"))?;
            let sets = [set];
            let mut create = vk::PipelineLayoutCreateInfo::default().set_layouts(&sets);
            if push_bytes > 0 {
                create = create.push_constant_ranges(&ranges);
            }
            let layout =
                match s.failures.memory().and_then(|()| s.device.create_pipeline_layout(&create, None)) {
                    Ok(l) => l,
                    Err(e) => {
                        s.device.destroy_descriptor_set_layout(set, None);
                        return Err(device_error("pipeline layout")(e));
                    }
                };
            Ok(Program {
                shared: s.clone(),
                name: stages[stages.len() - 1].name,
                pipeline: vk::Pipeline::null(),
                layout,
                set,
                bindings: bindings.into_iter().map(|(b, _)| b).collect(),
                stages: stage_flags,
                push_bytes,
                bind_point,
            })
        }
    }
}

impl Program {
    /// Path of its last stage under `shaders/`.
    pub fn name(&self) -> &'static str {
        self.name
    }
}

impl Drop for Program {
    fn drop(&mut self) {
        if self.pipeline != vk::Pipeline::null() {
            let mut live = lock(&self.shared.pipelines);
            let left = live.get(self.name).map_or(0, |n| n - 1);
            if left == 0 {
                live.remove(self.name)
            } else {
                live.insert(self.name, left)
            };
        }
        self.shared.retire(Retired::Program(self.pipeline, self.layout, self.set));
    }
}

/// A shader module for the time of making a pipeline.
struct Module<'a> {
    shared: &'a Shared,
    handle: vk::ShaderModule,
}

impl<'a> Module<'a> {
    fn new(shared: &'a Shared, shader: &Shader) -> Result<Self> {
        let words = bytemuck::pod_collect_to_vec::<u8, u32>(shader.spirv);
        let create = vk::ShaderModuleCreateInfo::default().code(&words);
        let handle = shared.failures.memory().and_then(|()| {
            // SAFETY: the words are SPIR-V from glslang.
            unsafe { shared.device.create_shader_module(&create, None) }
        });
        Ok(Module { shared, handle: handle.map_err(device_error(shader.name))? })
    }
}

impl Drop for Module<'_> {
    fn drop(&mut self) {
        // SAFETY: a module is not used once its pipeline is made.
        unsafe { self.shared.device.destroy_shader_module(self.handle, None) };
    }
}

/// Refuses constants that no stage declares, and stages with constants that are not given: neither would be heard of.
fn check_constants(stages: &[&'static Shader], constants: &[(&str, u32)]) -> Result<()> {
    let declared = || stages.iter().flat_map(|s| s.constants.iter().map(move |(name, _)| (s.name, *name)));
    let unknown = constants.iter().find(|(name, _)| declared().all(|(_, known)| known != *name));
    if let Some((name, _)) = unknown {
        let stages: Vec<_> = stages.iter().map(|s| s.name).collect();
        return Err(Error::Usage(format!("{}: no specialization constant \"{name}\"", stages.join(", "))));
    }
    match declared().find(|(_, known)| constants.iter().all(|(name, _)| name != known)) {
        Some((stage, name)) => {
            Err(Error::Usage(format!("{stage}: specialization constant \"{name}\" is not given")))
        }
        None => Ok(()),
    }
}

/// Where a stage's constants are among the values.
fn specialization(stage: &Shader, constants: &[(&str, u32)]) -> Vec<vk::SpecializationMapEntry> {
    let entry = |(k, (name, _)): (usize, &(&str, u32))| {
        let (_, id) = stage.constants.iter().find(|(known, _)| known == name)?;
        Some(vk::SpecializationMapEntry { constant_id: *id, offset: 4 * k as u32, size: 4 })
    };
    constants.iter().enumerate().filter_map(entry).collect()
}

fn values(constants: &[(&str, u32)]) -> Vec<u8> {
    constants.iter().flat_map(|(_, value)| value.to_ne_bytes()).collect()
}
