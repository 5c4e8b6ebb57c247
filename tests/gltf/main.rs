//! glTF in: geometry, attributes and parts of scenes made by code; faults; real files where they are.
#![cfg(feature = "formats")]

mod attributes;
mod builder;
#[cfg(feature = "cli")]
mod command;
mod compressed;
mod faults;
mod files;
mod geometry;
#[cfg(feature = "images")]
mod images;
#[cfg(feature = "cli")]
mod real;
mod real_scenes;
mod scenes;
mod written;
