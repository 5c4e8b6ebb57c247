//! What comes: where it is put, and what is told of it.

use super::super::describe::diagonal;
use super::super::numbers::{count, grouped, of_diagonal};
use super::super::output::{MeshFormat, Output};
use super::super::progress::Progress;
use super::light::Light;
use super::set::Members;
use super::steps::Step;
use super::{Args, Sink, Source, shown};
use serde_json::{Value, json};
use std::io::Write;
use std::sync::Arc;
use unweld::client::Version;
use unweld::container::{Contents, Plan};

/// What comes is put where it belongs, and told of.
pub struct Told<'a> {
    pub args: &'a Args,
    pub output: &'a Output,
    pub sink: &'a mut Sink,
    pub address: String,
    pub resumed: u64,
    pub progress: Progress,
}

impl Told<'_> {
    fn talks(&self) -> bool {
        !self.args.quiet && !self.args.json
    }

    /// Header and table of contents.
    pub fn begin(&mut self, bytes: &[u8], version: &Version, line: &str) -> anyhow::Result<()> {
        if self.talks() {
            self.output.say(line)?;
        }
        if let (Sink::Part(part), 0) = (&mut *self.sink, self.resumed) {
            part.begin(&self.address, version)?;
        }
        self.sink.write(0, bytes)
    }

    /// An atom; so many bytes of how many are done, and perhaps a step.
    pub fn atom(
        &mut self,
        offset: u64,
        bytes: &[u8],
        [done, total]: [u64; 2],
        line: Option<String>,
    ) -> anyhow::Result<()> {
        self.sink.write(offset, bytes)?;
        self.progress.update("fetch", done, total);
        match line.filter(|_| self.talks()) {
            Some(line) => self.progress.aside(|| self.output.say(&line)),
            None => Ok(()),
        }
    }

    pub fn end(self, of: Of, steps: Vec<Step>, source: &Source) -> anyhow::Result<Got> {
        if let Sink::Stream(out) = self.sink {
            out.flush()?;
        }
        let (received, requests) = (source.http.received(), source.http.requests());
        let version = source.version();
        Ok(Got { of, steps, light: None, version, received, requests, resumed: self.resumed })
    }
}

/// What came.
pub struct Got {
    pub of: Of,
    /// What became of its images, where few pixels of them were wanted.
    pub light: Option<Light>,
    pub steps: Vec<Step>,
    pub version: Version,
    pub received: u64,
    pub requests: u64,
    pub resumed: u64,
}

/// What it came of.
pub enum Of {
    Mesh(Arc<Contents>, Plan),
    Set(Members),
}

impl Got {
    /// Where what came ends in the file.
    pub fn end(&self) -> u64 {
        match &self.of {
            Of::Mesh(_, plan) => plan.end(),
            Of::Set(members) => members.end(),
        }
    }

    pub fn json(&self, args: &Args, output: &Output) -> Value {
        let mut object = match &self.of {
            Of::Mesh(contents, plan) => mesh_json(contents, plan),
            Of::Set(members) => members.json(),
        };
        let common = json!({
            "url": shown(&args.url),
            "output": output.name,
            "etag": self.version.tag,
            "received_bytes": self.received,
            "resumed_bytes": self.resumed,
            "requests": self.requests,
            "steps": self.steps.iter().map(Step::json).collect::<Vec<_>>(),
        });
        if let (Value::Object(object), Value::Object(common)) = (&mut object, common) {
            object.extend(common);
            if let (Some(light), Of::Mesh(contents, _)) = (&self.light, &self.of) {
                object.insert("textures".to_owned(), light.json(contents));
            }
        }
        object
    }

    pub fn summary(&self, output: &Output, format: Option<MeshFormat>) -> String {
        let received =
            format!("{} received in {}", count(self.received, "byte"), count(self.requests, "request"));
        if format.is_some() {
            return format!("  {received}\n");
        }
        let (name, end) = (&output.name, self.end());
        if let (Some(light), Of::Mesh(contents, _)) = (&self.light, &self.of) {
            return format!("{name}: {}; {received}\n", light.text(contents));
        }
        let (all, reached) = match &self.of {
            Of::Mesh(contents, plan) => (contents.file_bytes(), {
                let level = reached(plan);
                let error = contents.level(level).map_or(0.0, |level| level.max_error);
                let error = of_diagonal(error, diagonal(contents, None));
                format!("level {level} of {}, error at most {error}", contents.base_level())
            }),
            Of::Set(members) => (members.file_bytes(), members.reached()),
        };
        if end == all {
            return format!("{name}: the whole file, {}; {received}\n", count(all, "byte"));
        }
        format!(
            "{name}: {} of {} bytes, {reached}; {received}\n  \
             it is the beginning of a file, which decode, info and view take as it is\n",
            grouped(end),
            grouped(all),
        )
    }
}

/// The finest level that is complete.
fn reached(plan: &Plan) -> u32 {
    if plan.complete { plan.level } else { plan.level + 1 }
}

fn mesh_json(contents: &Contents, plan: &Plan) -> Value {
    let &Plan { level, complete, vertices, triangles, .. } = plan;
    let reached = reached(plan);
    json!({
        "file_bytes": contents.file_bytes(),
        "bytes": plan.byte_count() + contents.header.table_end(),
        "level": reached,
        "complete": complete || level == reached,
        "vertices": vertices,
        "triangles": triangles,
        "max_error": contents.level(reached).map(|level| level.max_error),
    })
}
