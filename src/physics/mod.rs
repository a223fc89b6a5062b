//! f64 models of the papers, without Vulkan: the oracle for the shaders of the same name.
