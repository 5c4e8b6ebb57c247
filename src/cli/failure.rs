//! How a command that failed says so: one line, and the exit code.

use clap::CommandFactory;
use clap::error::ErrorKind;
use std::process::ExitCode;

/// Arguments that do not go together, where clap cannot see it.
#[derive(Debug)]
pub struct Usage(pub String);

impl std::fmt::Display for Usage {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for Usage {}

/// Writes the error to standard error and returns the exit code.
pub fn report(error: &anyhow::Error) -> ExitCode {
    if let Some(usage) = error.downcast_ref::<Usage>() {
        // What cannot be printed cannot be helped.
        let _ = super::Cli::command().error(ErrorKind::ArgumentConflict, usage).print();
        return ExitCode::from(2);
    }
    note(&line(error));
    ExitCode::from(1)
}

/// Writes a line to standard error, whatever becomes of it.
pub fn note(text: &str) {
    use std::io::Write;
    let _ = writeln!(std::io::stderr(), "unweld: {text}");
}

/// The causes from the outermost to the innermost, each once, without line breaks.
pub fn line(error: &anyhow::Error) -> String {
    let mut causes: Vec<String> = Vec::new();
    for cause in error.chain().map(ToString::to_string) {
        // An error that only hands on its cause has the same text.
        if causes.last() != Some(&cause) {
            causes.push(cause);
        }
    }
    let escape = |c: char| if c.is_control() { c.escape_default().to_string() } else { c.to_string() };
    causes.join(": ").chars().map(escape).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use anyhow::Context;

    #[test]
    fn one_line_and_every_cause_once() {
        let inner = unweld::Error::Format(unweld::error::FormatError::new(8, "3.2", "odd\nthing"));
        let error = Err::<(), _>(inner).context("a\tb.uwm").unwrap_err();
        assert_eq!(line(&error), "a\\tb.uwm: byte 8: odd\\nthing (spec §3.2)");
    }
}
