//! Programs that a script starts, with their arguments.

/// Returns the words of each command in a script for `sh`. Understands the syntax that pages use: quotes, comments, continued lines, and separators.
///
/// Redirections (`> FILE`) are left out.
pub(crate) fn commands(script: &str) -> Vec<Vec<String>> {
    let (mut all, mut words, mut word) = (Vec::new(), Vec::new(), None::<String>);
    let mut letters = script.chars().peekable();
    while let Some(letter) = letters.next() {
        match letter {
            '\\' if letters.peek() == Some(&'\n') => {
                letters.next();
                words.extend(word.take());
            }
            '\'' | '"' => {
                let inside: String = letters.by_ref().take_while(|&next| next != letter).collect();
                word.get_or_insert_default().push_str(&inside);
            }
            '#' if word.is_none() => while letters.next_if(|&next| next != '\n').is_some() {},
            '\n' | ';' | '|' | '&' | '(' | ')' => {
                words.extend(word.take());
                all.push(std::mem::take(&mut words));
            }
            letter if letter.is_whitespace() => words.extend(word.take()),
            letter => word.get_or_insert_default().push(letter),
        }
    }
    words.extend(word);
    all.push(words);
    all.into_iter().map(started).filter(|words| !words.is_empty()).collect()
}

/// Returns the words of the program, without keywords of the shell before them and redirections after them.
fn started(words: Vec<String>) -> Vec<String> {
    const SHELL: [&str; 4] = ["do", "then", "else", "done"];
    let own = words.into_iter().skip_while(|word| SHELL.contains(&word.as_str()));
    own.take_while(|word| !word.starts_with('>') && (!word.starts_with('<') || word.len() > 1 && word.ends_with('>'))).collect()
}

/// Replaces `cargo run --release -- …` by `cohaptic …`, the program that it starts.
pub(crate) fn without_cargo(script: &str) -> String {
    script.replace("cargo run --release -- ", "cohaptic ")
}

#[test]
fn the_commands_of_a_script_are_found() {
    let words = |script: &str| commands(script).into_iter().map(|words| words.join(" ")).collect::<Vec<_>>();
    let script = "for k in 1 2; do  # twice\n    cohaptic check a.toml --set 'expect={ stable = true }' | jq '.a | .b'\ndone\n";
    assert_eq!(words(script), ["for k in 1 2", "cohaptic check a.toml --set expect={ stable = true }", "jq .a | .b"]);
    assert_eq!(words("cohaptic run a \\\n    --out b > c && cmp b c"), ["cohaptic run a --out b", "cmp b c"]);
    assert_eq!(words("cohaptic run [OPTIONS] <SCENE>"), ["cohaptic run [OPTIONS] <SCENE>"]);
}
