//! Members of a set of meshes: which there are, and each as a file of its own.

use super::args::{Bound, Tolerance};
use super::numbers::{count, grouped, of_diagonal, percent, significant, table};
use super::progress::Progress;
use super::quality::Quality;
use super::uwm::{ReadSeek, Uwm};
use anyhow::{Context, bail};
use serde_json::{Value, json};
use std::io::{Cursor, Read, Seek, SeekFrom};
use std::sync::Arc;
use unweld::container::{Header, Measure, SetContents, VERSION, Want, parse_set, plan_from_keyframe};
use unweld::decoder::Until;

/// A file that is a set.
pub struct Set {
    /// What it is called in messages.
    pub name: String,
    /// Its members.
    pub contents: SetContents,
    bytes: Box<dyn ReadSeek>,
    /// The member at hand.
    at: Option<u32>,
}

impl Set {
    /// Header and table, if the file is a set; else it is as it was.
    ///
    /// # Errors
    /// Those of the medium, and where header or table are at fault.
    pub fn read(bytes: &mut dyn ReadSeek, name: &str) -> anyhow::Result<Option<Self>> {
        let mut head = Vec::new();
        (&mut *bytes).take(Header::SIZE as u64).read_to_end(&mut head)?;
        if !SetContents::is_set(&head) {
            bytes.seek(SeekFrom::Start(0))?;
            return Ok(None);
        }
        let start =
            head.first_chunk().map(SetContents::head_bytes).transpose().map_err(unweld::Error::from)?;
        let rest = start.unwrap_or(head.len()) - head.len();
        (&mut *bytes).take(rest as u64).read_to_end(&mut head)?;
        let Some(contents) = parse_set(&head).map_err(unweld::Error::from)? else {
            bail!("byte {}: the table of the set is cut off", head.len());
        };
        let bytes = Box::new(Cursor::new(Vec::new()));
        Ok(Some(Self { name: name.to_owned(), contents, bytes, at: None }))
    }

    /// The same over these bytes.
    pub fn over(self, bytes: Box<dyn ReadSeek>) -> Self {
        Self { bytes, ..self }
    }

    /// A member as a file of its own.
    fn file(&mut self, number: u32) -> anyhow::Result<Vec<u8>> {
        let member = &self.contents.members[number as usize];
        let mut file = member.head.clone();
        self.bytes.seek(SeekFrom::Start(member.bytes.start)).with_context(|| self.name.clone())?;
        let length = member.bytes.end - member.bytes.start;
        let read = (&mut self.bytes).take(length).read_to_end(&mut file);
        read.with_context(|| self.name.clone())?;
        let missing = length - (file.len() - member.head.len()) as u64;
        if missing > 0 {
            let there = member.bytes.end - missing;
            bail!(
                "{}: byte {there}: the file is cut off: member {number} lacks {}",
                self.name,
                count(missing, "byte")
            );
        }
        Ok(file)
    }

    /// How long the diagonal of the box of all members is.
    pub fn diagonal(&self) -> f64 {
        self.contents.members[0].contents.header.diagonal()
    }

    /// The table for people.
    pub fn table(&self) -> String {
        let diagonal = self.diagonal();
        let mut lines = vec![
            ["member", "vertices", "triangles", "bytes", "with those it takes", "max error", "rms error", ""]
                .map(str::to_owned)
                .to_vec(),
        ];
        for number in self.contents.in_file_order() {
            let member = &self.contents.members[number as usize];
            let level = member.level();
            let relative = |x: f64| match percent(x, diagonal) {
                Some(percent) => format!("{} %", significant(percent, 3)),
                None => significant(x, 3),
            };
            let errors = [Measure::Max, Measure::Rms].map(|measure| relative(level.error(measure)));
            let [max, rms] = errors;
            let before = if self.contents.finest_first { number.wrapping_sub(1) } else { number + 1 };
            let leans = if member.leans { format!("beside {before}") } else { "alone".to_owned() };
            let bytes = grouped(member.bytes.end - member.bytes.start);
            let all = grouped(self.contents.cost(number));
            lines.push(vec![
                number.to_string(),
                grouped(level.vertices),
                grouped(level.triangles),
                bytes,
                all,
                max,
                rms,
                leans,
            ]);
        }
        table(&lines)
    }

    /// All of it for programs.
    pub fn described(&self) -> Value {
        let lattice = self.contents.lattice();
        json!({
            "format_version": VERSION,
            "file_bytes": self.contents.file_bytes(),
            "finest_first": self.contents.finest_first,
            "lattice": { "origin": lattice.origin, "step": lattice.step, "bits": lattice.bits },
            "members": self.members_json(),
        })
    }

    fn members_json(&self) -> Value {
        let diagonal = self.diagonal();
        let members = (0..).zip(&self.contents.members).map(|(number, member)| {
            let level = member.level();
            json!({
                "member": number,
                "vertices": level.vertices,
                "triangles": level.triangles,
                "offset": member.bytes.start,
                "bytes": member.bytes.end - member.bytes.start,
                "bytes_with_needed": self.contents.cost(number),
                "beside_another": member.leans,
                "max_error": level.max_error,
                "rms_error": level.rms_error,
                "max_error_percent": percent(level.max_error, diagonal),
                "rms_error_percent": percent(level.rms_error, diagonal),
                "exact": !member.contents.correction().is_empty(),
                "keep_order": !member.contents.order().is_empty(),
            })
        });
        Value::Array(members.collect())
    }

    /// In a few words.
    pub fn summary(&self) -> String {
        let order = if self.contents.finest_first { "the finest first" } else { "the coarsest first" };
        let lattice = self.contents.lattice();
        format!(
            "  {:<11}{} on a lattice of {} bits, step {}, {order}\n",
            "set",
            count(self.contents.members.len() as u64, "mesh"),
            lattice.bits,
            of_diagonal(lattice.step, self.diagonal()),
        )
    }
}

impl Uwm {
    /// Goes to a member, where this is a set; tells the level of the file at hand that is wanted: 0 there, else `level` as it is.
    ///
    /// # Errors
    /// Where there is no such member, or it cannot be read; those of decoding what it leans on.
    pub fn enter(&mut self, level: u32, progress: &mut Progress) -> anyhow::Result<u32> {
        let Some(set) = &self.set else { return Ok(level) };
        let name = set.name.clone();
        let mut chain = set.contents.chain(level);
        if chain.is_empty() {
            let last = set.contents.members.len() - 1;
            bail!("{name}: there is no member {level}: they are 0 (finest) to {last}");
        }
        if set.at == Some(level) {
            return Ok(0);
        }
        let mut known = None;
        // The member at hand may be one of those that it takes.
        if let Some(place) = chain.iter().position(|&number| set.at == Some(number)) {
            known = Some(self.places(progress)?);
            chain.drain(..=place);
        }
        for number in chain {
            let Some(set) = &mut self.set else { break };
            let file = set.file(number)?;
            let member = &set.contents.members[number as usize];
            let (contents, other) = (member.contents.clone(), known.take().filter(|_| member.leans));
            set.at = Some(number);
            self.name = format!("{name}, member {number}");
            self.become_member(file, contents, other);
            if number != level {
                known = Some(self.places(progress)?);
            }
        }
        Ok(0)
    }

    /// Goes to the member that is wanted, where this is a set.
    ///
    /// # Errors
    /// As [`Uwm::enter`].
    pub fn enter_wanted(&mut self, quality: &Quality, progress: &mut Progress) -> anyhow::Result<()> {
        let Some(set) = &self.set else { return Ok(()) };
        let number = wanted(&set.contents, quality);
        self.enter(number, progress).map(drop)
    }

    /// How many members it has, where it is a set.
    pub fn members(&self) -> Option<Vec<u32>> {
        self.set.as_ref().map(|set| set.contents.in_file_order())
    }

    /// Where the vertices of the member at hand are, in the order of its walk.
    fn places(&mut self, progress: &mut Progress) -> anyhow::Result<Arc<[[i32; 3]]>> {
        let mut plan = plan_from_keyframe(&self.contents, 0);
        plan.parts = vec![self.part(self.contents.steps(0))];
        let decoder = self.decode(Some(&plan), Until::default(), progress, &mut |_, _| Ok(()))?;
        Ok(decoder.mesh().positions.as_slice().into())
    }
}

/// The number of the member that is wanted; there may be none of this number.
pub fn wanted(contents: &SetContents, quality: &Quality) -> u32 {
    let diagonal = || contents.members[0].contents.header.diagonal();
    contents.wanted(match *quality {
        Quality { level: Some(level), .. } => return level,
        Quality { triangles: Some(most), .. } => Want::Triangles(most),
        Quality { error: Some(Bound { measure, most }), .. } => match most {
            Tolerance::Absolute(most) => Want::Error(measure, most),
            Tolerance::Percent(percent) => Want::Error(measure, percent / 100.0 * diagonal()),
        },
        Quality { max_bytes: Some(most), .. } => Want::Bytes(most),
        _ => Want::All,
    })
}
