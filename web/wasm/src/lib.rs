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
    resource: Vec<u8>,
    /// What [`unweld_take`], [`unweld_terms`] and [`unweld_report`] point to.
    table: Vec<u32>,
}

thread_local! {
    static INSTANCE: RefCell<Instance> = RefCell::new(Instance::new(Settings::default()));
}

/// What may be set, by bit of `settings` in [`unweld_new`]: positions relative to the lattice's origin, [`unweld_coarsen`], jumps,
/// [`unweld_resource`].
const SETTINGS: [&str; 5] = ["relative", "levels", "jumps", "resources", "ownNormals"];
/// What may be wanted, by number, each with a value: everything; a level; a largest error, or a root mean square, of at most so much; at most so many triangles.
const WANTS: [&str; 5] = ["all", "level", "max", "rms", "triangles"];
/// What [`unweld_poll`] and [`unweld_finish`] return, by number.
const OUTCOMES: [&str; 3] = ["waits", "event", "fault"];

/// Begins anew, with [`SETTINGS`] by bit and one of [`WANTS`].
#[unsafe(no_mangle)]
pub extern "C" fn unweld_new(settings: u32, want: u32, value: f64) {
    let [relative, undo, jumps, resources, own_normals] = std::array::from_fn(|bit| settings >> bit & 1 != 0);
    let settings = Settings { want: wanted(want, value), relative, undo, jumps, resources, own_normals };
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

/// Hands over the first `length` bytes of the room, which are those of the file from byte `at` on.
#[unsafe(no_mangle)]
pub extern "C" fn unweld_push(at: f64, length: u32) {
    with(|instance| {
        let input = std::hint::black_box(&instance.input);
        instance.client.push(at as u64, input.get(..length as usize).unwrap_or(input));
    });
}

/// Leaves out resources, by their numbers: the first `length` bytes of the room, four for each, little end first.
#[unsafe(no_mangle)]
pub extern "C" fn unweld_skip(length: u32) {
    with(|instance| {
        let input = std::hint::black_box(&instance.input);
        let (numbers, _) = input.get(..length as usize).unwrap_or(input).as_chunks();
        let numbers: Vec<u32> = numbers.iter().map(|&bytes| u32::from_le_bytes(bytes)).collect();
        instance.client.skip(&numbers);
    });
}

/// Adds a resource that was left out: the first `length` bytes of the room. Returns one of [`OUTCOMES`].
#[unsafe(no_mangle)]
pub extern "C" fn unweld_add(number: u32, length: u32) -> u32 {
    with(|instance| {
        let input = std::hint::black_box(&instance.input);
        let bytes = input.get(..length as usize).unwrap_or(input);
        outcome(if instance.client.add_resource(number, bytes).is_ok() { "event" } else { "fault" })
    })
}

/// A resource that is whole, told as by [`unweld_report`]; it is let go of. Of one that is not there, no bytes.
#[unsafe(no_mangle)]
pub extern "C" fn unweld_resource(number: u32) -> u32 {
    with(|instance| {
        instance.resource = instance.client.take_resource(number).unwrap_or_default();
        let words = place(&instance.resource);
        instance.tell(&words)
    })
}

/// Decodes up to the next event: one of [`OUTCOMES`].
#[unsafe(no_mangle)]
pub extern "C" fn unweld_poll() -> u32 {
    with(|instance| match instance.client.poll() {
        Ok(false) => outcome("waits"),
        Ok(true) => outcome("event"),
        Err(_) => outcome("fault"),
    })
}

/// Says that no more bytes will come: one of [`OUTCOMES`], and no event.
#[unsafe(no_mangle)]
pub extern "C" fn unweld_finish() -> u32 {
    with(|instance| outcome(if instance.client.finish().is_ok() { "waits" } else { "fault" }))
}

/// About how many numbers have changed.
#[unsafe(no_mangle)]
pub extern "C" fn unweld_waiting() -> u32 {
    with(|instance| u32::try_from(instance.client.waiting()).unwrap_or(u32::MAX))
}

/// What numbers mean here, as JSON: `settings`, `wants` and `outcomes` by name, and of `fields`, which [`unweld_take`] tells, name and kind of each
/// of [`Changes`], in order. Told as by [`unweld_report`].
#[unsafe(no_mangle)]
pub extern "C" fn unweld_terms() -> u32 {
    with(|instance| {
        let list = |names: &[&str]| format!("[\"{}\"]", names.join("\",\""));
        let fields = instance.changes.fields().map(|(name, field)| list(&[name, field.kind()]));
        let (settings, wants, outcomes) = (list(&SETTINGS), list(&WANTS), list(&OUTCOMES));
        instance.tell_text(format!(
            "{{\"settings\":{settings},\"wants\":{wants},\"outcomes\":{outcomes},\"fields\":[{}]}}",
            fields.join(",")
        ))
    })
}

/// What has changed: the address of two words for each of the fields of [`unweld_terms`]: address and length of an array, or a number, or the bits of one in
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
            Field::Bytes(array) => place(array),
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
            resource: Vec::new(),
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
    match WANTS.get(want as usize).copied() {
        Some("level") => Want::Level(value as u32),
        Some("max") => Want::Error(Measure::Max, value),
        Some("rms") => Want::Error(Measure::Rms, value),
        Some("triangles") => Want::Triangles(value as u32),
        _ => Want::All,
    }
}

/// The number of one of [`OUTCOMES`].
fn outcome(name: &str) -> u32 {
    OUTCOMES.iter().position(|known| *known == name).unwrap_or_default() as u32
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
