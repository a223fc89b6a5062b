//! Procedural species, written as glTF and read back as glTF.
