//! Serving `.uwm` files over HTTP (spec §12): whole files and ranges, and the atoms that lead a client from one level to another.
//!
//! `decide` sees what a request asks for and knows no more of HTTP than headers and queries; `http` speaks it; `listen` bounds what
//! connections may take. The server reads tables of contents and bytes, never a mesh: no payload can harm it.

mod body;
mod decide;
mod http;
mod library;
mod listen;
mod metrics;
mod page;
mod tables;

use std::time::Duration;

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
    /// Most connections at a time; more wait until one ends.
    pub connections: usize,
    /// How long a connection may take to send the head of a request, the pause before it included.
    pub idle: Duration,
    /// How long a client may take no byte of an answer.
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
            connections: 4096,
            idle: Duration::from_secs(30),
            stall: Duration::from_secs(30),
            grace: Duration::from_secs(20),
        }
    }
}

/// The media type of a `.uwm` file (spec §12.1).
pub const MEDIA_TYPE: &str = "model/vnd.unweld";
