//! A set of meshes (spec §15): a page has its members as levels, each of which takes the place of the one before as a whole.
//!
//! Members come in the order of the file up to the one that is wanted: they need the ones before them, or show something sooner.

use super::{Client, report};
use crate::container::{Member, SetContents, Want, parse_set};
use crate::decoder::{Decoder, Event, Options};
use crate::error::{Error, FormatError, Result};
use std::sync::Arc;

/// What is known of a set.
#[derive(Debug)]
pub(super) struct Members {
    contents: SetContents,
    /// Members in the order of the file, and how many of them have been decoded.
    order: Vec<u32>,
    done: usize,
    /// Those decoded and not shown, by number.
    kept: Vec<Option<Decoder>>,
    /// The one at hand, and bytes of the file that it has been given.
    decoder: Option<Decoder>,
    given: u64,
    /// Where the vertices are of the one decoded last.
    other: Arc<[[i32; 3]]>,
    shown: Option<u32>,
}

impl Members {
    fn new(contents: SetContents) -> Self {
        Self {
            order: contents.in_file_order(),
            done: 0,
            kept: contents.members.iter().map(|_| None).collect(),
            decoder: None,
            given: contents.head_end(),
            other: Arc::default(),
            shown: None,
            contents,
        }
    }

    /// The wanted member, and how many there are up to it in the file. A finer one that is there will do; to go down, all are taken.
    fn wanted(&self, want: Want, undo: bool) -> (u32, usize) {
        let number = self.contents.wanted(want);
        let count = match (self.contents.finest_first, self.shown) {
            (true, _) if undo => self.order.len(),
            (true, Some(shown)) if shown <= number => self.done,
            (true, _) => number as usize + 1,
            (false, _) => self.order.len() - number as usize,
        };
        (number, count)
    }

    /// Decodes the next member with the bytes that are held, from byte `at` of the file on; its number, once it is whole.
    fn advance(&mut self, at: u64, held: &[u8]) -> Result<Option<u32>> {
        let Some(&number) = self.order.get(self.done) else { return Ok(None) };
        let member = &self.contents.members[number as usize];
        let mut decoder = self.decoder.take().unwrap_or_else(|| {
            let mut decoder = Decoder::new(Options { mesh_alone: true, ..Options::default() });
            if member.leans {
                decoder.beside(self.other.clone());
            }
            decoder.push(&member.head);
            decoder
        });
        loop {
            match decoder.poll() {
                Ok(Some(Event::End)) => break,
                Ok(Some(_)) => {}
                Ok(None) => {
                    let from = self.given.saturating_sub(at).min(held.len() as u64) as usize;
                    let count = (member.bytes.end - self.given).min((held.len() - from) as u64) as usize;
                    if count == 0 {
                        self.decoder = Some(decoder);
                        return Ok(None);
                    }
                    decoder.push(&held[from..from + count]);
                    self.given += count as u64;
                }
                Err(error) => {
                    self.decoder = Some(decoder);
                    return Err(of_member(error, member, number));
                }
            }
        }
        self.other = decoder.mesh().positions.as_slice().into();
        self.done += 1;
        self.kept[number as usize] = Some(decoder);
        Ok(Some(number))
    }
}

impl Client {
    /// Whether the file is a set, or may still become known to be one.
    pub(super) fn is_set(&self) -> bool {
        self.set.is_some() || self.head.as_ref().is_some_and(|head| SetContents::is_set(head))
    }

    /// As [`Client::poll`]: decodes up to the next member that is whole.
    pub(super) fn poll_set(&mut self) -> Result<bool> {
        let outcome = self.next_member();
        if let Err(error) = &outcome {
            self.reports.push(report::fault(error, None));
        }
        outcome
    }

    fn next_member(&mut self) -> Result<bool> {
        if let Some(head) = &self.head {
            let Some(contents) = parse_set(head)? else { return Ok(false) };
            self.held = self.head.take().unwrap_or_default();
            self.set = Some(Members::new(contents));
            let wanted = self.wanted_member();
            self.reports.extend(self.set.as_ref().map(|set| report::set(&set.contents, wanted)));
            return Ok(true);
        }
        let keeps = self.settings.undo;
        let Some(set) = &mut self.set else { return Ok(false) };
        let (wanted, count) = set.wanted(self.settings.want, keeps);
        if set.done >= count {
            let told = std::mem::replace(&mut self.ended, true);
            if !told {
                self.reports.push(report::end());
            }
            return Ok(!told);
        }
        let whole = set.advance(self.held_at, &self.held)?;
        let finest_first = set.contents.finest_first;
        let shown = set.shown;
        let given = set.given.saturating_sub(self.held_at).min(self.held.len() as u64);
        self.drop_held(given as usize);
        let Some(number) = whole else { return Ok(false) };
        let finer = shown.is_none_or(|shown| number < shown);
        if finer && (!finest_first || number == wanted) {
            self.show_member(number);
            self.tell_member(number);
        }
        Ok(true)
    }

    /// Puts a member that is kept into the place of the one that is shown.
    fn show_member(&mut self, number: u32) {
        let Some(set) = &mut self.set else { return };
        let count = set.contents.members.len();
        let Some(decoder) = set.kept[number as usize].take() else { return };
        let before = std::mem::replace(&mut self.decoder, decoder);
        if let Some(shown) =
            set.shown.replace(number).filter(|_| self.settings.undo || set.contents.finest_first)
        {
            set.kept[shown as usize] = Some(before);
        }
        self.tell_all_again();
        self.reports.extend(self.decoder.contents().map(|contents| report::attributes(contents, count)));
        self.residue_waits = true;
        self.residue();
    }

    /// Tells of a member that it is there.
    fn tell_member(&mut self, number: u32) {
        let Some(set) = &self.set else { return };
        self.reports.push(report::member(&set.contents, number, "level"));
        let told = self.decoder.metadata().zip(self.decoder.contents());
        self.reports.extend(told.map(|(metadata, contents)| report::metadata(metadata, &contents.header)));
    }

    /// As [`Client::want`].
    pub(super) fn want_member(&mut self) {
        let Some(set) = &self.set else { return };
        let (number, _) = set.wanted(self.settings.want, self.settings.undo);
        let is_kept = set.kept[number as usize].is_some();
        if is_kept && set.shown.is_none_or(|shown| number < shown) {
            self.show_member(number);
            self.tell_member(number);
        }
        self.ended = false;
        let wanted = self.wanted_member();
        self.reports.push(report::other(wanted));
    }

    /// What is wanted, for the page.
    fn wanted_member(&self) -> serde_json::Value {
        let (Some(set), Some(end)) = (&self.set, self.members_end()) else { return serde_json::Value::Null };
        report::wanted_member(&set.contents, set.wanted(self.settings.want, self.settings.undo).0, end)
    }

    /// Where the last member ends that is wanted or has been decoded.
    pub(super) fn members_end(&self) -> Option<u64> {
        let set = self.set.as_ref()?;
        let (_, count) = set.wanted(self.settings.want, self.settings.undo);
        let last = *set.order.get(count.max(set.done).checked_sub(1)?)?;
        Some(set.contents.members[last as usize].bytes.end)
    }

    /// Whether all members that are wanted have been decoded.
    pub(super) fn has_members(&self) -> bool {
        self.set.as_ref().is_some_and(|set| set.done >= set.wanted(self.settings.want, self.settings.undo).1)
    }

    /// Where a file that has ended is cut off.
    pub(super) fn cut_set(&self) -> Error {
        let (at, what) = match &self.set {
            Some(set) => (
                set.given,
                format!("the file is cut off in member {}", set.order.get(set.done).copied().unwrap_or(0)),
            ),
            None => (
                self.head.as_ref().map_or(0, |head| head.len() as u64),
                "the table of the set is cut off".to_owned(),
            ),
        };
        FormatError::new(at, "15.1", what).into()
    }

    /// Shows the next coarser member that is there, or the next finer one.
    pub(super) fn step(&mut self, coarser: bool) -> Option<u32> {
        let set = self.set.as_ref()?;
        let shown = set.shown?;
        let is_kept = |number: &u32| set.kept[*number as usize].is_some();
        let last = set.kept.len() as u32;
        let number = if coarser { (shown + 1..last).find(is_kept) } else { (0..shown).rev().find(is_kept) }?;
        self.show_member(number);
        Some(number)
    }
}

/// An error of a member's file as one of the set's.
fn of_member(error: Error, member: &Member, number: u32) -> Error {
    let Error::Format(fault) = error else { return error };
    let offset = (fault.offset + member.bytes.start).saturating_sub(member.head.len() as u64);
    FormatError { offset, what: format!("member {number}: {}", fault.what), ..fault }.into()
}
