//! Cached bakes: the file as it is, and the same bytes as the content of a file whose header and checksum are right.
#![no_main]

mod common;

use std::cell::Cell;

use canopy::bake::CacheState;
use canopy::bake::file::{Format, load_or_build};
use libfuzzer_sys::fuzz_target;

const FORMAT: Format = Format { magic: *b"CANOPYFZ", version: 1, extension: "fuzzed" };
const SIZES: [usize; 3] = [12, 0, 100];

fuzz_target!(|bytes: &[u8]| {
    let dir = std::env::temp_dir().join(format!("canopy-fuzz-cache-{}", std::process::id()));
    std::fs::create_dir_all(&dir).expect("TMPDIR can be written");
    let key = [7; 32];
    let path = FORMAT.path(&dir, &key);
    let genuine = [&FORMAT.magic[..], &FORMAT.version.to_le_bytes(), &key, bytes].concat();
    let sealed = [&genuine[..], blake3::hash(&genuine).as_bytes()].concat();
    for file in [bytes, &sealed[..]] {
        std::fs::write(&path, file).expect("TMPDIR can be written");
        let built = Cell::new(false);
        let (parts, state) = load_or_build(
            (Some(&dir), &FORMAT, &key),
            &SIZES,
            |parts| parts,
            |parts: &Vec<Vec<u8>>, put| parts.iter().try_for_each(|p| put(p)),
            || {
                built.set(true);
                Ok(SIZES.map(|n| vec![1; n]).to_vec())
            },
            true,
        )
        .expect("a damaged cache costs time, never the result");
        assert!(parts.iter().map(Vec::len).eq(SIZES));
        assert_eq!(state == CacheState::Hit, !built.get());
        let whole = std::fs::read(&path).expect("a file stands there");
        // What was believed is what the file holds; what was not has been replaced by what was built.
        assert_eq!(parts.concat(), whole[44..whole.len() - 32]);
        assert_eq!(blake3::hash(&whole[..whole.len() - 32]), blake3::Hash::from_slice(&whole[whole.len() - 32..]).unwrap());
    }
});
