#![no_main]

use libfuzzer_sys::fuzz_target;

fuzz_target!(|data: &[u8]| unweld::fuzzing::fuzz_scene_writer(data));
