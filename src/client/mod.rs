//! Meshes as they arrive: streams of [events](crate::decoder::Event) over any reader, or over whatever gives ranges of bytes
//! (feature `client`).
//!
//! # From a reader
//! ```
//! # #[cfg(feature = "encode")] {
//! use futures_util::StreamExt;
//! use unweld::client;
//! use unweld::decoder::{Event, Options};
//!
//! # let file = unweld::encoder::Encoder::default().encode_to_vec(&unweld::mesh::shapes::bumpy_sphere(4, 1))?;
//! # let reader = &file[..];
//! # tokio::runtime::Builder::new_current_thread().build()?.block_on(async {
//! let mut events = client::refine(reader, Options::default());
//! while let Some(event) = events.next().await {
//!     if let Event::Level { level, max_error, .. } = event? {
//!         let triangles = events.decoder().mesh().table.triangle_count();
//!         println!("level {level}: {triangles} triangles, error {max_error}");
//!     }
//! }
//! # assert_eq!(events.decoder().level(), Some(0));
//! # Ok::<(), unweld::Error>(())
//! # })?;
//! # }
//! # Ok::<(), unweld::Error>(())
//! ```
//!
//! # From a server, no more than is needed
//! ```no_run
//! # async fn shown() -> unweld::Result<()> {
//! use futures_util::TryStreamExt;
//! use unweld::client::{self, Http, HttpOptions};
//! use unweld::container::{Measure, Want, plan};
//! use unweld::decoder::Options;
//!
//! let source = Http::new("https://example.org/bunny.uwm", HttpOptions::default())?;
//! let want = Want::Error(Measure::Max, 0.01);
//! let mut events = client::refine_ranges(source, move |contents| Ok(plan(contents, want)), Options::default());
//! while events.try_next().await?.is_some() {}
//! let mesh = events.decoder().assembled()?;
//! # Ok(())
//! # }
//! ```
//! [`plan_from_keyframe`](crate::container::plan_from_keyframe) instead of [`plan`](crate::container::plan()) skips what a keyframe
//! stands for.
//!
//! # Cancelling
//! Nothing runs but what is polled: to stop, drop the stream. The connection is closed with it. Nothing is read ahead of what has been
//! decoded, so a slow taker slows the sender down.

mod feed;
mod http;
mod members;
mod refinement;
mod source;
mod transfer;

pub use feed::Begun;
pub use http::{Http, HttpOptions, Retry, Version};
pub use members::{SetPiece, SetTransfer};
pub use refinement::{Refinement, refine, refine_ranges};
pub use source::{Fault, RangeSource};
pub use transfer::{FIRST_BYTES, Piece, Transfer, whole_file};
