//! The documents do what they say: the shell commands of the guide are run, and the links of all documents lead somewhere.
//!
//! In `docs/guide` a block of language `sh` holds `endowire` commands alone, one a line (a backslash at the end carries a line on, `#` begins
//! a comment); a block with `file=NAME` after its language is that file, written where it stands among the commands. Each chapter has a
//! folder of its own with a copy of `assets`. Other blocks are not looked at.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::common::{said, workspace};

/// What a chapter has its reader do.
#[derive(Debug, PartialEq)]
enum Action {
    Write { name: String, text: String },
    Run { line: usize, arguments: Vec<String> },
}

/// The chapters of the guide, in their order.
fn chapters() -> Vec<PathBuf> {
    let entries = std::fs::read_dir(workspace().join("docs/guide")).unwrap();
    let mut chapters: Vec<_> =
        entries.map(|e| e.unwrap().path()).filter(|p| p.extension().is_some_and(|e| e == "md")).collect();
    chapters.sort();
    chapters
}

/// Words of a command line: blanks between them, but for those in double quotes.
fn words(line: &str) -> Result<Vec<String>, String> {
    let (mut words, mut word, mut quoted) = (Vec::new(), None::<String>, false);
    for c in line.chars() {
        match c {
            '"' => {
                quoted = !quoted;
                word.get_or_insert_default();
            }
            '#' if !quoted && word.is_none() => break,
            c if c.is_whitespace() && !quoted => words.extend(word.take()),
            '|' | '>' | '<' | '&' | ';' | '$' | '`' | '\'' | '*' if !quoted => {
                return Err(format!("{c:?} is not understood outside double quotes"));
            }
            c => word.get_or_insert_default().push(c),
        }
    }
    words.extend(word);
    if quoted { Err("a double quote is not closed".into()) } else { Ok(words) }
}

/// Files and commands of a chapter.
fn actions(chapter: &str) -> Result<Vec<Action>, String> {
    let mut found = Vec::new();
    let mut lines = (1..).zip(chapter.lines());
    while let Some((begin, line)) = lines.next() {
        let Some(info) = line.strip_prefix("```") else { continue };
        let mut block = Vec::new();
        loop {
            match lines.next() {
                Some((_, "```")) => break,
                Some(inside) => block.push(inside),
                None => return Err(format!("line {begin}: the block is not closed")),
            }
        }
        let (language, rest) = info.split_once(' ').unwrap_or((info, ""));
        if let Some(name) = rest.strip_prefix("file=") {
            let text = block.iter().map(|(_, line)| format!("{line}\n")).collect();
            found.push(Action::Write { name: name.to_owned(), text });
        } else if language == "sh" {
            let mut command = String::new();
            for (number, line) in block {
                if let Some(begun) = line.strip_suffix('\\') {
                    command.push_str(begun);
                    continue;
                }
                command.push_str(line);
                let words = words(&command).map_err(|e| format!("line {number}: {e}"))?;
                command.clear();
                match words.split_first() {
                    None => {}
                    Some((program, arguments)) if program == "endowire" => {
                        found.push(Action::Run { line: number, arguments: arguments.to_vec() });
                    }
                    Some((program, _)) => return Err(format!("line {number}: {program} is not endowire")),
                }
            }
            if !command.is_empty() {
                return Err(format!("line {begin}: the last command goes on beyond the block"));
            }
        }
    }
    Ok(found)
}

fn copy(from: &Path, to: &Path) {
    std::fs::create_dir_all(to).unwrap();
    for entry in std::fs::read_dir(from).unwrap().map(Result::unwrap) {
        let target = to.join(entry.file_name());
        if entry.file_type().unwrap().is_dir() {
            copy(&entry.path(), &target);
        } else {
            std::fs::copy(entry.path(), target).unwrap();
        }
    }
}

/// Does what a chapter says in a new folder; the commands that were run, or what went wrong.
fn follow(chapter: &str) -> Result<Vec<Vec<String>>, String> {
    let actions = actions(chapter)?;
    let folder = tempfile::tempdir().unwrap();
    for part in ["cases", "ct", "devices", "scenes", "subjects", "vessels"] {
        copy(&workspace().join("assets").join(part), &folder.path().join("assets").join(part));
    }
    let mut run = Vec::new();
    for action in actions {
        match action {
            Action::Write { name, text } => std::fs::write(folder.path().join(name), text).unwrap(),
            Action::Run { line, arguments } => {
                let output = Command::new(env!("CARGO_BIN_EXE_endowire"))
                    .env("ENDOWIRE_CACHE", concat!(env!("CARGO_TARGET_TMPDIR"), "/cache"))
                    .args(&arguments)
                    .current_dir(folder.path())
                    .output()
                    .unwrap();
                if output.status.code() != Some(0) {
                    return Err(format!(
                        "line {line}: endowire {}: {}\n{}",
                        arguments.join(" "),
                        output.status,
                        said(&output)
                    ));
                }
                run.push(arguments);
            }
        }
    }
    Ok(run)
}

#[test]
fn every_command_of_the_guide_works() {
    let mut commands = BTreeSet::new();
    let mut failures = Vec::new();
    for path in chapters() {
        match follow(&std::fs::read_to_string(&path).unwrap()) {
            Ok(run) => commands.extend(run.into_iter().map(|arguments| arguments[0].clone())),
            Err(what) => failures.push(format!("{}: {what}", path.display())),
        }
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
    // That nothing is run would also be no failure.
    let all = "assess bench compare completions dataset device doctor experiment export fluoro man new play render report rod run subject sweep verify vessel";
    assert_eq!(commands.into_iter().collect::<Vec<_>>().join(" "), all);
}

#[test]
fn the_scene_of_the_readme_works() {
    let readme = std::fs::read_to_string(workspace().join("README.md")).unwrap();
    let (_, scene) = readme.split_once("```toml\n").unwrap();
    let (scene, _) = scene.split_once("```").unwrap();
    let chapter =
        format!("```toml file=scene.toml\n{scene}```\n```sh\nendowire run scene.toml --json\n```\n");
    assert_eq!(follow(&chapter).unwrap().len(), 1);
}

#[test]
fn a_broken_command_fails() {
    let chapter =
        |command: &str| format!("Text.\n\n```sh\nendowire --version # it is there\n{command}\n```\n");
    let good = "endowire rod \\\n    \"assets/cases/tip_force.toml\"";
    assert_eq!(follow(&chapter(good)).unwrap().len(), 2);
    for (command, expected) in [
        ("endowire rod assets/cases/tip_farce.toml", "line 5: endowire rod assets/cases/tip_farce.toml"),
        ("endowire rod assets/cases/tip_force.toml --jason", "--json"),
        ("endowire rood assets/cases/tip_force.toml", "'rod'"),
        ("cargo test", "line 5: cargo is not endowire"),
        ("endowire rod a.toml || true", "line 5: '|' is not understood"),
        ("endowire rod \\", "goes on beyond the block"),
    ] {
        let reported = follow(&chapter(command)).unwrap_err();
        assert!(reported.contains(expected), "{command}: {reported}");
    }
    assert!(actions("```sh\nendowire --version\n").unwrap_err().contains("not closed"));
    // A file is written as it stands, and a wrong key in it is found.
    let case = "```toml file=case.toml\n[rod]\nlengthy = 1.0\n```\n```sh\nendowire rod case.toml\n```\n";
    let reported = follow(case).unwrap_err();
    assert!(reported.contains("line 6") && reported.contains("length"), "{reported}");
    // Blocks that are only shown are not run.
    assert_eq!(actions("```text\nendowire nonsense\n```\n```console\n$ cargo test\n```\n"), Ok(vec![]));
}

/// Targets of the links and pictures of a document, but for those in blocks of code and on the web.
fn links(document: &str) -> Vec<String> {
    let mut inside = false;
    let mut found = Vec::new();
    for line in document.lines() {
        inside ^= line.starts_with("```");
        if inside {
            continue;
        }
        for piece in line.split("](").skip(1) {
            let target = piece.split(')').next().unwrap_or_default().split('#').next().unwrap_or_default();
            if !target.is_empty() && !target.contains("://") {
                found.push(target.to_owned());
            }
        }
    }
    found
}

#[test]
fn every_link_of_the_documents_leads_to_a_file() {
    let root = workspace();
    let mut documents = chapters();
    for folder in [root.clone(), root.join("docs"), root.join("docs/methods"), root.join("docs/decisions")] {
        let entries = std::fs::read_dir(&folder).unwrap().map(|e| e.unwrap().path());
        documents.extend(entries.filter(|p| p.extension().is_some_and(|e| e == "md")));
    }
    let mut count = 0;
    for document in documents {
        for link in links(&std::fs::read_to_string(&document).unwrap()) {
            assert!(document.parent().unwrap().join(&link).exists(), "{}: {link}", document.display());
            count += 1;
        }
    }
    assert!(count > 20, "{count} links");
    assert_eq!(links("[a](b.md) and ![c](d/e.png#f), [g](#h), [i](https://j.k)"), ["b.md", "d/e.png"]);
}

/// Paths of Rust files, or of folders of them, that stand in back-ticks.
fn paths(document: &str) -> impl Iterator<Item = &str> {
    let quoted = document.split('`').skip(1).step_by(2);
    quoted.filter(|text| {
        let plain = text.chars().all(|c| c.is_ascii_alphanumeric() || "_-./".contains(c));
        plain && (text.ends_with(".rs") || (text.contains('/') && text.ends_with('/')))
    })
}

/// Paths of all files below a folder, without the `src` of crates, as documents shorten them.
fn files_below(folder: &Path, found: &mut Vec<String>) {
    for entry in std::fs::read_dir(folder).unwrap().map(Result::unwrap) {
        let path = entry.path();
        if path.is_dir() && entry.file_name() != "target" {
            files_below(&path, found);
            found.push(path.to_string_lossy().replace("/src/", "/") + "/");
        } else {
            found.push(path.to_string_lossy().replace("/src/", "/"));
        }
    }
}

#[test]
fn every_file_that_a_decision_names_is_there() {
    let root = workspace();
    let mut files = Vec::new();
    for folder in ["crates", "tests", "benches", "docs"] {
        files_below(&root.join(folder), &mut files);
    }
    let is_there = |path: &str| {
        let end = format!("/{}", path.replace("/src/", "/"));
        files.iter().any(|file| file.ends_with(&end))
    };
    assert!(is_there("kirchhoff/command.rs") && is_there("cli/src/main.rs") && is_there("contact/pairs/"));
    assert!(!is_there("kirchhoff/commend.rs") && !is_there("mmand.rs"));
    let mut documents = vec![root.join("ARCHITECTURE.md"), root.join("docs/glossary.md")];
    documents.extend(std::fs::read_dir(root.join("docs/decisions")).unwrap().map(|e| e.unwrap().path()));
    let mut count = 0;
    for document in documents {
        for path in paths(&std::fs::read_to_string(&document).unwrap()) {
            assert!(is_there(path), "{}: {path}", document.display());
            count += 1;
        }
    }
    assert!(count > 100, "{count} paths");
}
