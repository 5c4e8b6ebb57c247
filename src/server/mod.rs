//! Serving `.uwm` files over HTTP (spec §12): whole files and ranges, and the atoms that lead a client from one level to another.
//!
//! `decide` sees what a request asks for and knows no more of HTTP than headers and queries; `http` speaks it; `listen` bounds what
//! connections may take. The server reads tables of contents and bytes, never a mesh: no payload can harm it.

mod access;
mod body;
mod decide;
mod http;
mod library;
mod listen;
mod metrics;
mod packing;
mod page;
mod seats;
mod sets;
mod tables;
mod watched;

use std::time::Duration;

pub use access::Origins;
pub use listen::Server;

/// What a server may spend, and how it answers.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Options {
    /// Whether the names of the meshes are told.
    pub list: bool,
    /// How many seconds caches may keep an answer without asking again; one to a query with `v` they may always keep.
    pub max_age: u32,
    /// Whoever sends one of these is served; where there are none, everybody is.
    pub tokens: Vec<String>,
    /// Which pages from elsewhere may read the answers.
    pub origins: Origins,
    /// Names that a server on a loopback address answers to beside the machine's own, such as the one that a proxy hands on; `*` is any. On other
    /// addresses every name will do.
    pub hosts: Vec<String>,
    /// Most connections at a time. Where more come, those that have been idle for the longest time make room; where none is idle they wait.
    pub connections: usize,
    /// How long a connection may take to send the head of a request, the pause before it included.
    pub idle: Duration,
    /// How long a client may take nothing of an answer. Its system may tell of what it takes in steps of 128 KiB: less than that within this time
    /// may count as nothing.
    pub stall: Duration,
    /// How long answers under way may still take once the server is to stop.
    pub grace: Duration,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            list: true,
            max_age: 60,
            tokens: Vec::new(),
            origins: Origins::Usual,
            hosts: Vec::new(),
            connections: 4096,
            idle: Duration::from_secs(30),
            stall: Duration::from_secs(60),
            grace: Duration::from_secs(20),
        }
    }
}

/// The media type of a `.uwm` file (spec §12.1).
pub const MEDIA_TYPE: &str = "model/vnd.unweld";
