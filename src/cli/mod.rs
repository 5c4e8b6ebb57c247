//! The command line: arguments and composition. A file for each command, and what several of them need.

mod args;
mod attribute_args;
mod attributes;
mod batch;
mod decode;
mod demo;
mod describe;
mod detail;
mod drawn;
mod encode;
mod failure;
mod fetch;
mod identity;
mod info;
mod input;
mod inputs;
mod lattice;
mod measure;
mod members;
mod memory;
mod morph;
mod numbers;
mod original;
mod output;
mod pack;
mod page;
mod parents;
mod progress;
mod quality;
mod replace;
mod resources;
mod scene;
mod scenes;
mod serve;
mod shown;
mod signals;
mod simplify;
mod triangles;
mod unpack;
mod uwm;
mod verify;
mod view;
mod welding;

use clap::{Parser, Subcommand};
use std::process::ExitCode;

#[derive(Parser)]
#[command(version, about = "Progressive triangle meshes: small files whose every prefix is a mesh")]
#[command(after_help = EXAMPLES, max_term_width = 100, arg_required_else_help = true)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    Encode(encode::Args),
    Decode(decode::Args),
    Info(info::Args),
    Verify(verify::Args),
    Measure(measure::Args),
    Simplify(simplify::Args),
    Morph(morph::Args),
    Lod(simplify::lod::Args),
    Pack(pack::Args),
    Unpack(unpack::Args),
    View(view::Args),
    Serve(serve::Args),
    Fetch(fetch::Args),
    Demo(demo::Args),
}

/// Runs the command of the process's arguments. The exit code is 0 where all went well, 1 where the data are at
/// fault, 2 where the arguments are.
pub fn run() -> ExitCode {
    signals::survive_large_files();
    let outcome = match Cli::parse().command {
        Command::Encode(args) => encode::run(&args),
        Command::Decode(args) => decode::run(&args),
        Command::Info(args) => info::run(&args),
        Command::Verify(args) => verify::run(&args),
        Command::Measure(args) => measure::run(&args),
        Command::Simplify(args) => simplify::run(&args),
        Command::Morph(args) => morph::run(&args),
        Command::Lod(args) => simplify::lod::run(&args),
        Command::Pack(args) => pack::run(&args),
        Command::Unpack(args) => unpack::run(&args),
        Command::View(args) => view::run(&args),
        Command::Serve(args) => serve::run(&args),
        Command::Fetch(args) => fetch::run(&args),
        Command::Demo(args) => demo::run(&args),
    };
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => failure::report(&error),
    }
}

const EXAMPLES: &str = "\
EXAMPLES
  unweld demo                                  see what it does
  unweld encode bunny.ply -o bunny.uwm         simplify and code
  unweld decode bunny.uwm -o bunny.obj         everything back
  unweld decode bunny.uwm -o - --triangles 5000    a coarser mesh, as PLY on standard output
  unweld info bunny.uwm                        its levels, their bytes and errors
  unweld verify bunny.uwm bunny.ply            is it sound, and is it that mesh?
  unweld measure bunny.ply small.ply           how far are they from each other?
  unweld simplify bunny.ply -o small.ply --ratio 10%    a coarser mesh
  unweld view bunny.uwm -o bunny.png           a picture of it
  unweld lod bunny.ply -o lods/ --levels 4     a mesh a level of detail
  unweld pack lods/*.ply -o lods.uwm           such meshes in one file
  unweld serve coded/                          all files of a folder over HTTP
  unweld fetch URL -o bunny.uwm                a file from a server, or as much as is wanted

Exit codes: 0 all went well, 1 the data are at fault, 2 the arguments are.";
