//! Centre lines as `.swc` files: rows of number, kind, x, y, z, radius and the number of the row before it, −1 at the root
//! (Cannon et al., *J. Neurosci. Methods* 84, 1998). Lengths are taken as mm.

use std::collections::BTreeMap;
use std::path::Path;

use super::CentrelineNode;
use crate::Vec3;

/// Whether a path names such a file.
pub(super) fn is_swc(path: &Path) -> bool {
    path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("swc"))
}

/// The points of a file, each after the one that it comes from.
pub(super) fn parse(text: &str) -> Result<Vec<CentrelineNode>, String> {
    let mut nodes: Vec<CentrelineNode> = Vec::new();
    let mut of_number: BTreeMap<i64, usize> = BTreeMap::new();
    for (index, line) in text.lines().enumerate() {
        let row = index + 1;
        let words: Vec<&str> = line.split('#').next().unwrap_or_default().split_whitespace().collect();
        if words.is_empty() {
            continue;
        }
        let [number, _, x, y, z, radius, before] = words[..] else {
            return Err(format!(
                "line {row}: {} columns: a row is number kind x y z radius before",
                words.len()
            ));
        };
        let real = |name: &str, word: &str| {
            word.parse::<f64>().map_err(|_| format!("line {row}: {name} = {word:?}: must be a number"))
        };
        let whole = |name: &str, word: &str| {
            word.parse::<i64>().map_err(|_| format!("line {row}: {name} = {word:?}: must be a whole number"))
        };
        let (number, before) = (whole("number", number)?, whole("before", before)?);
        let parent = match of_number.get(&before) {
            Some(parent) => Some(*parent),
            None if before != -1 => {
                return Err(format!("line {row}: before = {before}: no row above has this number"));
            }
            None if nodes.is_empty() => None,
            None => return Err(format!("line {row}: a second root: a vessel has one, join them")),
        };
        if of_number.insert(number, nodes.len()).is_some() {
            return Err(format!("line {row}: number = {number}: a row above has it too"));
        }
        let position_mm = Vec3::new(real("x", x)?, real("y", y)?, real("z", z)?);
        nodes.push(CentrelineNode { position_mm, radius_mm: real("radius", radius)?, parent });
    }
    Ok(nodes)
}

#[cfg(test)]
mod tests {
    use crate::Vec3;
    use crate::vessel::CentrelineTree;
    use std::path::Path;

    fn read(text: &str) -> Result<CentrelineTree, String> {
        CentrelineTree::from_bytes(text.as_bytes(), Path::new("tree.SWC")).map_err(|error| error.to_string())
    }

    #[test]
    fn rows_are_a_tree_by_their_numbers() {
        let tree =
            read("# a fork\n10 1 0 0 0 3.5 -1\n 7 3 0 0 2 3 10\n3 3 0 0 4 2 7 # up\n9 3 2 0 4 1.5 7\n")
                .unwrap();
        let nodes = tree.nodes();
        assert_eq!(nodes.len(), 4);
        assert_eq!((nodes[0].parent, nodes[0].radius_mm), (None, 3.5));
        assert_eq!((nodes[2].parent, nodes[3].parent), (Some(1), Some(1)));
        assert_eq!(nodes[3].position_mm, Vec3::new(2.0, 0.0, 4.0));
    }

    #[test]
    fn swc_files_that_are_no_tree_are_refused_by_line() {
        let root = "1 1 0 0 0 2 -1\n";
        for (rest, part) in [
            ("2 1 0 0 1 2\n", "line 2: 6 columns"),
            ("2 1 0 0 1 2 5\n", "line 2: before = 5"),
            ("2 1 0 0 1 2 -1\n", "line 2: a second root"),
            ("1 1 0 0 1 2 1\n", "line 2: number = 1"),
            ("2 1 0 z 1 2 1\n", "line 2: y = \"z\""),
            ("2.5 1 0 0 1 2 1\n", "line 2: number = \"2.5\""),
            ("2 1 0 0 1 -2 1\n", "radius"),
            ("2 1 0 0 nan 2 1\n", "z = NaN"),
            ("", "at least 2"),
        ] {
            let refused = read(&format!("{root}{rest}")).unwrap_err();
            assert!(refused.contains(part) && refused.contains("tree.SWC"), "{rest}: {refused}");
        }
    }
}
