//! Compiles every shader in `shaders/` with glslang (through shaderc), reflects it with SPIRV-Reflect, and writes
//! the Rust side: `shaders.rs` (SPIR-V, descriptor bindings and specialization constants) and `interface.rs` (the structs and constants of
//! `shaders/interface.glsl`, with compile-time checks of every offset and size).
//!
//! Two builds of each shader: an optimised one for Vulkan 1.3 that runs, and an unoptimised one for Vulkan 1.0
//! that is reflected, because SPIRV-Reflect 0.2.3 does not understand the newer one. Results are kept by content
//! under OUT_DIR, so a changed shader recompiles only itself and those that include the changed file.

use std::collections::HashMap;
use std::collections::hash_map::DefaultHasher;
use std::fmt::Write as _;
use std::hash::{Hash, Hasher};
use std::path::{Path, PathBuf};
use std::{env, fs};

use spirv_reflect::ShaderModule;
use spirv_reflect::types::{ReflectBlockVariable, ReflectDescriptorType, ReflectTypeFlags};

type Fallible<T> = Result<T, Box<dyn std::error::Error>>;

fn main() -> Fallible<()> {
    println!("cargo:rerun-if-changed=shaders");
    println!("cargo:rerun-if-changed=build.rs");
    let out = PathBuf::from(env::var("OUT_DIR")?);
    let root = PathBuf::from("shaders");
    let mut sources = Vec::new();
    collect(&root, &mut sources)?;
    sources.sort();

    let compiler = shaderc::Compiler::new()?;
    let (mut rust, mut all) = (String::new(), String::new());
    let mut types = HashMap::new();
    for path in &sources {
        let name = path.strip_prefix(&root)?.to_string_lossy().replace('\\', "/");
        let text = expand(path, &root, &mut Vec::new())?;
        let constants = constants(&text).map_err(|e| format!("{name}: {e}"))?;
        for c in &constants {
            let known = types.entry(c.name.clone()).or_insert_with(|| (c.kind.clone(), name.clone()));
            if known.0 != c.kind {
                let (kind, first) = known;
                return Err(format!("{name}: {} is {}, and {kind} in {first}", c.name, c.kind).into());
            }
        }
        let entry = cached(&out, &name, &text, |key| {
            shader(&compiler, &name, path, (&constants, invocations(&text)), &root, &out, key)
        })?;
        rust.push_str(&entry);
        write!(all, "&{}, ", name.replace(['/', '.'], "_").to_uppercase())?;
    }
    writeln!(rust, "/// All of them.\npub static ALL: &[&Shader] = &[{all}];")?;
    fs::write(out.join("shaders.rs"), rust)?;

    let interface = root.join("interface.glsl");
    let text = fs::read_to_string(&interface)?;
    let generated = cached(&out, "interface", &text, |_| structs(&compiler, &text, &root))?;
    fs::write(out.join("interface.rs"), generated)?;
    Ok(())
}

/// Every entry point under `folder`.
fn collect(folder: &Path, sources: &mut Vec<PathBuf>) -> Fallible<()> {
    for entry in fs::read_dir(folder)? {
        let path = entry?.path();
        if path.is_dir() {
            collect(&path, sources)?;
        } else if matches!(path.extension().and_then(|e| e.to_str()), Some("vert" | "frag" | "comp")) {
            sources.push(path);
        }
    }
    Ok(())
}

/// The text of a shader with everything that it includes: what its compiled form depends on.
fn expand(path: &Path, root: &Path, seen: &mut Vec<PathBuf>) -> Fallible<String> {
    if seen.contains(&path.to_path_buf()) {
        return Ok(String::new());
    }
    seen.push(path.to_path_buf());
    let text = fs::read_to_string(path).map_err(|e| format!("{}: {e}", path.display()))?;
    let mut all = String::new();
    for line in text.lines() {
        match line.trim().strip_prefix("#include \"").and_then(|l| l.strip_suffix('"')) {
            Some(name) => all.push_str(&expand(&root.join(name), root, seen)?),
            None => all.push_str(line),
        }
        all.push('\n');
    }
    Ok(all)
}

/// A specialization constant: callers set it by its name, which means the same in every shader.
struct Constant {
    name: String,
    kind: String,
    id: u32,
}

/// The specialization constants of a shader with everything that it includes.
fn constants(text: &str) -> Fallible<Vec<Constant>> {
    let mut found: Vec<Constant> = Vec::new();
    for line in text.lines().filter(|l| l.contains("constant_id")) {
        let parsed = line.trim().strip_prefix("layout(constant_id = ").and_then(|rest| {
            let (id, declaration) = rest.split_once(") const ")?;
            let (left, _) = declaration.split_once('=')?;
            let (kind, name) = left.trim().split_once(' ')?;
            Some(Constant { name: name.trim().into(), kind: kind.into(), id: id.parse().ok()? })
        });
        let constant = parsed.ok_or_else(|| {
            format!("\"{}\" is not like layout(constant_id = N) const TYPE NAME = VALUE;", line.trim())
        })?;
        found.push(constant);
    }
    Ok(found)
}

/// Invocations a workgroup of a shader with everything that it includes: the product of its local sizes.
fn invocations(text: &str) -> u32 {
    let sizes = text.match_indices("local_size_").map(|(at, _)| {
        let number = text[at..].trim_start_matches(|c: char| !c.is_ascii_digit());
        number.split(|c: char| !c.is_ascii_digit()).next().and_then(|n| n.parse::<u32>().ok()).unwrap_or(1)
    });
    sizes.product::<u32>().max(1)
}

/// `make(key)`, or what it returned for the same text before; the key names the text, and whatever `make` writes beside
/// must carry it in its name: a shader changed and changed back would else meet the SPIR-V of the change.
fn cached(
    out: &Path,
    name: &str,
    text: &str,
    make: impl FnOnce(&str) -> Fallible<String>,
) -> Fallible<String> {
    let mut hasher = DefaultHasher::new();
    (text, include_str!("build.rs"), name).hash(&mut hasher);
    let stem = name.replace(['/', '.'], "_");
    let key = format!("{stem}.{:016x}", hasher.finish());
    let file = out.join(format!("{key}.rs"));
    if let Ok(known) = fs::read_to_string(&file) {
        return Ok(known);
    }
    let made = make(&key)?;
    fs::write(&file, &made)?;
    Ok(made)
}

fn options(root: &Path, reflect: bool) -> Fallible<shaderc::CompileOptions<'static>> {
    let mut o = shaderc::CompileOptions::new()?;
    let version = if reflect { shaderc::EnvVersion::Vulkan1_0 } else { shaderc::EnvVersion::Vulkan1_3 };
    o.set_target_env(shaderc::TargetEnv::Vulkan, version as u32);
    o.set_warnings_as_errors();
    o.set_optimization_level(if reflect {
        shaderc::OptimizationLevel::Zero
    } else {
        shaderc::OptimizationLevel::Performance
    });
    let root = root.to_path_buf();
    o.set_include_callback(move |name, _, _, _| {
        let path = root.join(name);
        let content = fs::read_to_string(&path).map_err(|e| format!("{}: {e}", path.display()))?;
        Ok(shaderc::ResolvedInclude { resolved_name: path.display().to_string(), content })
    });
    Ok(o)
}

/// Compiles and reflects one shader; writes its SPIR-V and returns its `static` in Rust.
fn shader(
    compiler: &shaderc::Compiler,
    name: &str,
    path: &Path,
    (constants, invocations): (&[Constant], u32),
    root: &Path,
    out: &Path,
    key: &str,
) -> Fallible<String> {
    let text = fs::read_to_string(path)?;
    let (kind, stage) = match path.extension().and_then(|e| e.to_str()) {
        Some("vert") => (shaderc::ShaderKind::Vertex, "VERTEX"),
        Some("frag") => (shaderc::ShaderKind::Fragment, "FRAGMENT"),
        _ => (shaderc::ShaderKind::Compute, "COMPUTE"),
    };
    let file = path.display().to_string();
    let run = compiler.compile_into_spirv(&text, kind, &file, "main", Some(&options(root, false)?))?;
    let reflected = compiler.compile_into_spirv(&text, kind, &file, "main", Some(&options(root, true)?))?;
    let stem = name.replace(['/', '.'], "_");
    fs::write(out.join(format!("{key}.spv")), run.as_binary_u8())?;

    let module = ShaderModule::load_u8_data(reflected.as_binary_u8())?;
    let mut bindings = Vec::new();
    for b in module.enumerate_descriptor_bindings(None)? {
        if b.set != 0 {
            return Err(
                format!("{name}: binding {} is in set {}; every binding is in set 0", b.name, b.set).into()
            );
        }
        let kind = match b.descriptor_type {
            ReflectDescriptorType::StorageBuffer => "STORAGE_BUFFER",
            ReflectDescriptorType::UniformBuffer => "UNIFORM_BUFFER",
            ReflectDescriptorType::UniformTexelBuffer => "UNIFORM_TEXEL_BUFFER",
            ReflectDescriptorType::CombinedImageSampler => "COMBINED_IMAGE_SAMPLER",
            ReflectDescriptorType::StorageImage => "STORAGE_IMAGE",
            other => return Err(format!("{name}: binding {} has an unused kind {other:?}", b.name).into()),
        };
        if b.name.is_empty() {
            return Err(
                format!("{name}: binding {} needs an instance name: callers bind by it", b.binding).into()
            );
        }
        bindings.push((b.binding, b.name.clone(), kind));
    }
    bindings.sort();
    // Not the block's own size: that is rounded up.
    let push = module.enumerate_push_constant_blocks(None)?.first().map_or(0, end);
    // Built-in variables have no location of their own.
    let outputs = module.enumerate_output_variables(None)?.into_iter().filter(|v| v.location < 1 << 16);
    let locations =
        outputs.map(|v| v.location + v.array.dims.iter().product::<u32>().max(1)).max().unwrap_or(0);
    let mut rust = String::new();
    writeln!(rust, "/// `shaders/{name}`.")?;
    writeln!(rust, "pub static {}: Shader = Shader {{", stem.to_uppercase())?;
    writeln!(rust, "    name: {name:?}, stage: vk::ShaderStageFlags::{stage}, push_constant_bytes: {push},")?;
    writeln!(rust, "    locations: {locations}, invocations: {invocations},")?;
    writeln!(rust, "    spirv: include_bytes!(concat!(env!(\"OUT_DIR\"), \"/{key}.spv\")),")?;
    writeln!(rust, "    bindings: &[")?;
    for (binding, name, kind) in bindings {
        writeln!(
            rust,
            "        Binding {{ binding: {binding}, name: {name:?}, kind: vk::DescriptorType::{kind} }},"
        )?;
    }
    writeln!(rust, "    ],\n    constants: &[")?;
    for c in constants {
        writeln!(rust, "        ({:?}, {}),", c.name, c.id)?;
    }
    writeln!(rust, "    ],\n}};")?;
    Ok(rust)
}

/// Where the last member of a block ends.
fn end(block: &ReflectBlockVariable) -> u32 {
    block.members.iter().map(end).max().unwrap_or(block.absolute_offset + block.size)
}

/// The Rust twin of `interface.glsl`: reflects each struct in a storage buffer and copies each constant.
fn structs(compiler: &shaderc::Compiler, text: &str, root: &Path) -> Fallible<String> {
    let mut rust = String::new();
    let mut docs: Vec<&str> = Vec::new();
    let mut names = Vec::new();
    for line in text.lines() {
        if let Some(doc) = line.strip_prefix("// ") {
            docs.push(doc);
        } else if let Some(rest) = line.strip_prefix("struct ") {
            let name = rest.trim_end_matches('{').trim();
            names.push((name.to_string(), docs.join(" ")));
            docs.clear();
        } else if let Some(rest) = line.strip_prefix("const ") {
            let (decl, note) = rest.split_once(';').ok_or("a constant ends with ;")?;
            let (left, value) = decl.split_once('=').ok_or("a constant has a value")?;
            let mut words = left.split_whitespace();
            let (ty, name) = (words.next().unwrap_or(""), words.next().unwrap_or(""));
            let (ty, value) = match ty {
                "uint" => ("u32", value.trim().trim_end_matches('u').to_string()),
                "int" => ("i32", value.trim().to_string()),
                "float" => ("f32", value.trim().to_string()),
                other => return Err(format!("interface.glsl: constant of type {other}").into()),
            };
            let doc = note.trim().trim_start_matches("//").trim();
            let doc = if doc.is_empty() { docs.join(" ") } else { doc.to_string() };
            writeln!(
                rust,
                "/// {doc}\n#[allow(clippy::excessive_precision)]\npub const {name}: {ty} = {value};"
            )?;
            docs.clear();
        } else {
            docs.clear();
        }
    }
    let mut probe = String::from(
        "#version 450\n#extension GL_GOOGLE_include_directive : require\n#include \"interface.glsl\"\n",
    );
    for (k, (name, _)) in names.iter().enumerate() {
        writeln!(probe, "layout(std430, set = 0, binding = {k}) buffer B{k} {{ {name} items[]; }} b{k};")?;
    }
    probe.push_str("void main() {}\n");
    let spirv = compiler.compile_into_spirv(
        &probe,
        shaderc::ShaderKind::Compute,
        "interface probe",
        "main",
        Some(&options(root, true)?),
    )?;
    let module = ShaderModule::load_u8_data(spirv.as_binary_u8())?;
    let blocks = module.enumerate_descriptor_bindings(None)?;
    for (k, (name, doc)) in names.iter().enumerate() {
        let block = blocks.iter().find(|b| b.binding == k as u32).ok_or("a struct got lost")?;
        let items = block.block.members.first().ok_or("a struct is empty")?;
        emit(&mut rust, name, doc, items, text)?;
    }
    Ok(rust)
}

fn emit(rust: &mut String, name: &str, doc: &str, block: &ReflectBlockVariable, text: &str) -> Fallible<()> {
    writeln!(
        rust,
        "/// {doc}\n#[repr(C)]\n#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]"
    )?;
    writeln!(rust, "pub struct {name} {{")?;
    let (mut at, mut pads, mut checks) = (0, 0, String::new());
    let pad = |rust: &mut String, at: u32, to: u32, pads: &mut u32| -> Fallible<()> {
        if to > at {
            writeln!(rust, "    #[doc(hidden)]\n    pub _pad{pads}: [u32; {}],", (to - at) / 4)?;
            *pads += 1;
        }
        Ok(())
    };
    for m in &block.members {
        pad(rust, at, m.offset, &mut pads)?;
        let ty = m.type_description.as_ref().ok_or("a member has no type")?;
        let n = &m.numeric;
        let scalar = if ty.type_flags.contains(ReflectTypeFlags::FLOAT) {
            "f32"
        } else if n.scalar.signedness == 1 {
            "i32"
        } else {
            "u32"
        };
        let (mut rust_ty, mut bytes) = match (n.matrix.column_count, n.vector.component_count) {
            (0, 0 | 1) => (scalar.to_string(), 4),
            (0, c) => (format!("[{scalar}; {c}]"), 4 * c),
            (4, _) if n.matrix.row_count == 4 => ("[[f32; 4]; 4]".to_string(), 64),
            _ => return Err(format!("{name}.{}: matrices are mat4", m.name).into()),
        };
        for dim in m.array.dims.iter().rev() {
            if m.array.stride != bytes {
                return Err(format!("{name}.{}: array elements must pack without gaps", m.name).into());
            }
            rust_ty = format!("[{rust_ty}; {dim}]");
            bytes *= dim;
        }
        writeln!(rust, "    /// {}\n    pub {}: {rust_ty},", member_doc(text, name, &m.name), m.name)?;
        writeln!(
            checks,
            "const _: () = assert!(core::mem::offset_of!({name}, {}) == {});",
            m.name, m.offset
        )?;
        at = m.offset + bytes;
    }
    // The stride of an array of these (std430): the end of the last member, rounded up to the widest alignment.
    // Reflection gives no stride for arrays without length.
    let size = at.next_multiple_of(block.members.iter().map(alignment).max().unwrap_or(4));
    pad(rust, at, size, &mut pads)?;
    writeln!(rust, "}}\nconst _: () = assert!(size_of::<{name}>() == {size});\n{checks}")?;
    Ok(())
}

/// Base alignment of a member in std430: of its vector, whose three components align like four.
fn alignment(member: &ReflectBlockVariable) -> u32 {
    match (member.numeric.matrix.column_count, member.numeric.vector.component_count) {
        (0, 0 | 1) => 4,
        (0, 2) => 8,
        _ => 16,
    }
}

/// The comment behind a member in interface.glsl.
fn member_doc(text: &str, name: &str, member: &str) -> String {
    text.split(&format!("struct {name} "))
        .nth(1)
        .and_then(|body| body.split("};").next())
        .into_iter()
        .flat_map(str::lines)
        .filter_map(|l| l.split_once(';'))
        .find(|(decl, _)| decl.split_whitespace().nth(1).is_some_and(|w| w.split('[').next() == Some(member)))
        .map_or(String::new(), |(_, note)| note.trim().trim_start_matches("//").trim().to_string())
}
