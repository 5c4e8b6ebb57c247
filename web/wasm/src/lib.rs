//! The exports of the WebAssembly module: one decoder an instance, addresses and lengths of its arrays.
//!
//! Each function is a call of [`Client`]. Addresses are told, never taken: the page writes into what [`unweld_room`] gives it and
//! reads what the others point to, until the next call. So there is no unsafe block here. The one unsafe thing is that symbols
//! are exported under fixed names: they would clash with symbols of the same name, and nothing else in the module is called
//! `unweld_…`, since Rust mangles what is not exported.

use std::cell::RefCell;
use unweld::container::{Measure, Want};
use unweld::wasm::{Changes, Client, Field, Settings};

/// What one instance of the module holds.
struct Instance {
    client: Client,
    input: Vec<u8>,
    changes: Changes,
    text: String,
    /// What [`unweld_take`], [`unweld_fields`] and [`unweld_report`] point to.
    table: Vec<u32>,
}

thread_local! {
    static INSTANCE: RefCell<Instance> = RefCell::new(Instance::new(Settings::default()));
}

/// Begins anew. `flags`: 1 for positions relative to the lattice's origin, 2 for [`unweld_coarsen`], 4 for jumps. `want`: 0 all, 1 level `value`,
/// 2 a largest error of at most `value`, 3 at most `value` triangles, 4 a root mean square error of at most `value`.
#[unsafe(no_mangle)]
pub extern "C" fn unweld_new(flags: u32, want: u32, value: f64) {
    let settings = Settings {
        want: wanted(want, value),
        relative: flags & 1 != 0,
        undo: flags & 2 != 0,
        jumps: flags & 4 != 0,
    };
    with(|instance| *instance = Instance::new(settings));
}

/// Wants something else, told as for [`unweld_new`].
#[unsafe(no_mangle)]
pub extern "C" fn unweld_want(want: u32, value: f64) {
    with(|instance| instance.client.want(wanted(want, value)));
}

/// The address of room for `length` bytes of input.
#[unsafe(no_mangle)]
pub extern "C" fn unweld_room(length: u32) -> u32 {
    with(|instance| {
        instance.input.resize(length as usize, 0);
        instance.input.as_mut_ptr().expose_provenance() as u32
    })
}

/// Hands over the first `length` bytes of the room.
#[unsafe(no_mangle)]
pub extern "C" fn unweld_push(length: u32) {
    with(|instance| {
        let input = std::hint::black_box(&instance.input);
        instance.client.push(input.get(..length as usize).unwrap_or(input));
    });
}

/// Decodes up to the next event: 0 where more bytes are needed, 1 where there was one, 2 where there is a fault.
#[unsafe(no_mangle)]
pub extern "C" fn unweld_poll() -> u32 {
    with(|instance| match instance.client.poll() {
        Ok(event) => u32::from(event),
        Err(_) => 2,
    })
}

/// Says that no more bytes will come: 0 where that is well, 2 where there is a fault.
#[unsafe(no_mangle)]
pub extern "C" fn unweld_finish() -> u32 {
    with(|instance| if instance.client.finish().is_ok() { 0 } else { 2 })
}

/// About how many numbers have changed.
#[unsafe(no_mangle)]
pub extern "C" fn unweld_waiting() -> u32 {
    with(|instance| u32::try_from(instance.client.waiting()).unwrap_or(u32::MAX))
}

/// What [`unweld_take`] tells, as JSON: name and kind of each field of [`Changes`], in order. Told as by [`unweld_report`].
#[unsafe(no_mangle)]
pub extern "C" fn unweld_fields() -> u32 {
    with(|instance| {
        let fields =
            instance.changes.fields().map(|(name, field)| format!("[\"{name}\",\"{}\"]", field.kind()));
        instance.tell_text(format!("[{}]", fields.join(",")))
    })
}

/// What has changed: the address of two words for each of [`unweld_fields`]: address and length of an array, or a number, or the bits of one in
/// binary32, and 0.
#[unsafe(no_mangle)]
pub extern "C" fn unweld_take() -> u32 {
    with(|instance| {
        instance.changes = Changes::default();
        instance.changes = instance.client.take();
        let words = instance.changes.fields().map(|(_, field)| match field {
            Field::Number(number) => [number, 0],
            Field::Length(length) => [length.to_bits(), 0],
            Field::Numbers(array) => place(array),
            Field::Coordinates(array) => place(array),
        });
        instance.tell(words.as_flattened())
    })
}

/// What has happened, as JSON: the address of address and length of the text in UTF-8.
#[unsafe(no_mangle)]
pub extern "C" fn unweld_report() -> u32 {
    with(|instance| {
        let report = instance.client.report();
        instance.tell_text(report)
    })
}

/// One level down: the level reached, or -1.
#[unsafe(no_mangle)]
pub extern "C" fn unweld_coarsen() -> i32 {
    with(|instance| level(instance.client.coarsen()))
}

/// One level up again: the level reached, or -1.
#[unsafe(no_mangle)]
pub extern "C" fn unweld_restore() -> i32 {
    with(|instance| level(instance.client.restore()))
}

impl Instance {
    fn new(settings: Settings) -> Self {
        Self {
            client: Client::new(settings),
            input: Vec::new(),
            changes: Changes::default(),
            text: String::new(),
            table: Vec::new(),
        }
    }

    fn tell(&mut self, numbers: &[u32]) -> u32 {
        numbers.clone_into(&mut self.table);
        self.table.as_ptr().expose_provenance() as u32
    }

    fn tell_text(&mut self, text: String) -> u32 {
        self.text = text;
        let words = place(self.text.as_bytes());
        self.tell(&words)
    }
}

fn wanted(want: u32, value: f64) -> Want {
    match want {
        1 => Want::Level(value as u32),
        2 => Want::Error(Measure::Max, value),
        3 => Want::Triangles(value as u32),
        4 => Want::Error(Measure::Rms, value),
        _ => Want::All,
    }
}

fn with<T>(act: impl FnOnce(&mut Instance) -> T) -> T {
    INSTANCE.with_borrow_mut(act)
}

fn place<T>(array: &[T]) -> [u32; 2] {
    [array.as_ptr().expose_provenance() as u32, array.len() as u32]
}

fn level(outcome: unweld::Result<Option<u32>>) -> i32 {
    outcome.ok().flatten().and_then(|level| i32::try_from(level).ok()).unwrap_or(-1)
}
