//! Shows a mesh growing while its bytes come from a server: `cargo run --release --example fetch -- URL [LEVEL]`.
//! Only what the level takes is asked for.

use futures_util::TryStreamExt;
use unweld::client::{self, Http, HttpOptions};
use unweld::container::{Want, plan};
use unweld::decoder::{Event, Options};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let Some(url) = arguments.first() else { return Err("URL [LEVEL]".into()) };
    let level = arguments.get(1).map_or(Ok(0), |level| level.parse())?;
    let source = Http::new(url, HttpOptions::default())?.on_retry(|retry| eprintln!("{}, again", retry.what));
    let mut events = client::refine_ranges(
        source,
        move |contents| Ok(plan(contents, Want::Level(level))),
        Options::default(),
    );
    tokio::runtime::Builder::new_current_thread().enable_all().build()?.block_on(async {
        while let Some(event) = events.try_next().await? {
            let triangles = events.decoder().mesh().table.triangle_count();
            match event {
                Event::Contents(contents) => {
                    println!("{} bytes, {} levels", contents.file_bytes(), contents.levels.len())
                }
                Event::Level { level, max_error, .. } => {
                    println!("level {level}: {triangles} triangles, error {max_error:.3e}")
                }
                _ => {}
            }
        }
        Ok(())
    })
}
