//! What a browser sees. Files of a page that come with the program belong into [`FILES`]; until there are some, a list of the meshes.

/// A file that comes with the program.
pub struct File {
    /// Its path, from `/` on.
    pub path: &'static str,
    /// Its media type.
    pub media_type: &'static str,
    /// What is in it.
    pub content: &'static [u8],
}

/// The file of this path, if there is one.
pub fn file(path: &str) -> Option<&'static File> {
    FILES.iter().find(|file| file.path == path)
}

/// The page at `/`: links to these meshes; `None` where they are not told.
pub fn index(names: Option<(&[String], bool)>) -> String {
    let list = match names {
        None => "<p>The names of the meshes are not told here.</p>".to_owned(),
        Some(([], _)) => "<p>There are no meshes here yet.</p>".to_owned(),
        Some((names, more)) => {
            let lines: String = names.iter().map(|name| line(name)).collect();
            let more = if more { "<p>There are more: see <a href=\"meshes\">the list</a>.</p>" } else { "" };
            format!("<ul>\n{lines}</ul>\n{more}")
        }
    };
    format!(
        "<!doctype html>\n<html lang=\"en\">\n<meta charset=\"utf-8\">\n<title>unweld</title>\n<h1>Meshes</h1>\n{list}\n\
         <p><a href=\"openapi.json\">Description of the interface</a></p>\n</html>\n"
    )
}

fn line(name: &str) -> String {
    let path: Vec<String> = name.split('/').map(encoded).collect();
    let path = path.join("/");
    let stem = path.strip_suffix(".uwm").unwrap_or(&path);
    let text = escaped(name);
    format!("<li><a href=\"meshes/{path}\">{text}</a> (<a href=\"meshes/{stem}/levels\">levels</a>)</li>\n")
}

fn encoded(part: &str) -> String {
    percent_encoding::utf8_percent_encode(part, percent_encoding::NON_ALPHANUMERIC)
        .to_string()
        .replace("%2E", ".")
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

const FILES: &[File] = &[];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_cannot_add_to_the_page() {
        let page = index(Some((&["a/<b>\"&'.uwm".to_owned()], true)));
        let line = "<li><a href=\"meshes/a/%3Cb%3E%22%26%27.uwm\">a/&lt;b&gt;&quot;&amp;'.uwm</a> \
                    (<a href=\"meshes/a/%3Cb%3E%22%26%27/levels\">levels</a>)</li>";
        assert!(page.contains(line) && page.contains("There are more"), "{page}");
        assert!(index(None).contains("not told") && index(Some((&[], false))).contains("no meshes"));
        assert!(file("/nothing").is_none());
    }
}
