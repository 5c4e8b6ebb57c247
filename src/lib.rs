//! unweld: a progressive-mesh encoding and streaming format.
//!
//! A simplifier takes a triangle mesh apart with stellar operations (edge flips and edge welds on a corner table) and records the
//! history. The coder writes a small whole mesh, the base, and then the history backwards, operation by operation: any prefix of a
//! `.uwm` file from the base on is a valid mesh, and the last byte brings back every triangle of the input, on a lattice of 8 to 24
//! bits a coordinate, or bit for bit (see [`encoder::Options::exact`]). The format is specified in `spec/`.
//!
//! # Encode and decode
//! ```
//! # #[cfg(feature = "encode")] {
//! use unweld::{decoder, encoder::Encoder, mesh::IndexedMesh};
//!
//! let positions = vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
//! let triangles = vec![[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]];
//! let file = Encoder::default().encode_to_vec(&IndexedMesh::new(positions, triangles))?;
//!
//! let decoder = decoder::decode(&file, decoder::Options::default())?;
//! let mesh = decoder.assembled()?;
//! assert_eq!((mesh.positions.len(), mesh.triangles.len()), (4, 4));
//! # }
//! # Ok::<(), unweld::Error>(())
//! ```
//!
//! # Refine while the bytes arrive
//! ```
//! # #[cfg(feature = "encode")] {
//! use std::io::Read;
//! use unweld::decoder::{Decoder, Event, Options};
//!
//! # let file = unweld::encoder::Encoder::default().encode_to_vec(&unweld::mesh::shapes::bumpy_sphere(4, 1))?;
//! # let mut slow = &file[..];
//! let mut decoder = Decoder::new(Options::default());
//! let mut packet = [0; 1400];
//! loop {
//!     let count = slow.read(&mut packet)?;
//!     if count == 0 {
//!         break;
//!     }
//!     decoder.push(&packet[..count]);
//!     while let Some(event) = decoder.poll()? {
//!         match event {
//!             Event::Refined(delta) => println!("upload vertices {:?} and triangles {:?}", delta.vertices, delta.triangles),
//!             Event::Level { level, max_error, .. } => println!("level {level} is complete, error {max_error}"),
//!             _ => {}
//!         }
//!     }
//! }
//! decoder.finish()?;
//! # assert_eq!(decoder.level(), Some(0));
//! # }
//! # Ok::<(), unweld::Error>(())
//! ```
//!
//! # Take a level of detail with an error below a bound
//! ```
//! # #[cfg(feature = "encode")] {
//! use unweld::container::{Measure, Want, parse_contents, plan};
//! use unweld::decoder::{Decoder, Options, Until};
//!
//! # let file = unweld::encoder::Encoder::default().encode_to_vec(&unweld::mesh::shapes::bumpy_sphere(4, 1))?;
//! // The table of contents tells which bytes are needed; only those have to be fetched.
//! let contents = parse_contents(&file)?.expect("the table of contents is there");
//! let want = Want::Error(Measure::Max, 0.1);
//! let (plan, until) = (plan(&contents, want), Until::of(want, &contents));
//! let mut decoder = Decoder::of_plan(contents, &plan, Options { until, ..Options::default() });
//! for part in &plan.parts {
//!     decoder.push(&file[part.bytes.start as usize..part.bytes.end as usize]);
//! }
//! while decoder.poll()?.is_some() {}
//! assert_eq!(decoder.level(), Some(plan.level));
//! # assert!(plan.level > 0 && plan.end() < file.len() as u64);
//! # }
//! # Ok::<(), unweld::Error>(())
//! ```
//!
//! # Features
//! `encode`: simplifier and encoder; `formats`: PLY, OBJ, STL, OFF and glTF; `draco`: glTF that Draco has compressed; `images`: previews of the images of scenes; `client`: meshes from readers and servers, as streams; `server`: the server, `cloud`: its object stores; `gpu`: the parallel removal on a GPU; `cli`
//! (default): the command line; `wasm`: what a browser needs, for the module that `web/wasm` makes; `fuzzing`: the bodies of the fuzz targets; `peers`: what the benchmark
//! `examples/table` compares with. Without any of them the crate is the decoder.

#[cfg(feature = "client")]
pub mod client;
pub mod codec;
pub mod container;
pub mod decoder;
#[cfg(feature = "encode")]
pub mod encoder;
#[cfg(not(feature = "fuzzing"))]
mod entropy;
#[cfg(feature = "fuzzing")]
pub mod entropy;
pub mod error;
#[cfg(feature = "formats")]
pub mod formats;
#[cfg(any(test, feature = "fuzzing"))]
pub mod fuzzing;
#[cfg(feature = "gpu")]
pub mod gpu;
pub mod limits;
pub mod mesh;
#[cfg(feature = "encode")]
pub mod reduce;
pub mod refine;
#[cfg(feature = "cli")]
pub mod render;
#[cfg(feature = "server")]
pub mod server;
#[cfg(feature = "encode")]
pub mod simplify;
#[cfg(feature = "server")]
pub mod store;
#[cfg(feature = "wasm")]
pub mod wasm;

pub use error::{Error, Result};
