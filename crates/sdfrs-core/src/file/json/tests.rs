use super::*;

fn fails(text: &str, path: &str, word: &str) {
    let error = Json::parse(text).expect_err(text);
    assert!(error.path == path && error.message.contains(word), "{text} gave {error}");
}

#[test]
fn numbers_keep_their_bits() {
    let mut bits = 0x9e37_79b9_7f4a_7c15_u64;
    let special =
        [0.0, -0.0, 0.1, 1.0, 1e23, 9007199254740993.0, f64::MIN_POSITIVE, 5e-324, f64::MAX, f64::MIN];
    for i in 0..200_000 {
        bits ^= bits << 13;
        bits ^= bits >> 7;
        bits ^= bits << 17;
        let v = special.get(i).copied().unwrap_or(f64::from_bits(bits));
        if v.is_finite() {
            let Json::Num(back) = Json::parse(&Json::Num(v).to_line()).unwrap() else {
                panic!("{v} is no number")
            };
            assert_eq!(back.to_bits(), v.to_bits(), "{v:e}");
        }
    }
    for v in [0, 1, -1, i64::MAX, i64::MIN] {
        assert_eq!(Json::parse(&Json::Int(v).to_line()).unwrap(), Json::Int(v));
    }
}

#[test]
fn texts_survive() {
    let value = Json::Object(vec![("a \"\\\n\u{1}\u{7f}é😀".into(), Json::text("\t\u{0}/</script>"))]);
    assert_eq!(Json::parse(&value.to_line()).unwrap(), value);
}

#[test]
fn refuses_loose_json() {
    fails(r#"{"a": 1, "a": 2}"#, "a", "twice");
    fails(r#"{"list": [1, {"b": {"c": 1, "c": 1}}]}"#, "list[1].b.c", "twice");
    fails("[NaN]", "[0]", "line 1");
    fails("[1, Infinity]", "[1]", "line 1");
    fails("[1e999]", "[0]", "out of range");
    fails("[-1e999]", "[0]", "out of range");
    fails("[1] 2", "file", "trailing");
    fails("", "file", "EOF");
    fails("[1,]", "[1]", "trailing comma");
    fails("{\"x\": [1, 2", "x[2]", "EOF");
    fails("// no\n1", "file", "line 1");
}

#[test]
fn refuses_depth_and_width() {
    let deep = "[".repeat(100_000);
    let error = Json::parse(&deep).expect_err("too deep");
    assert!(error.message.contains("recursion limit") && error.path.starts_with("[0][0]"), "{error}");
    assert!(error.path.len() < 100);
    let wide: Vec<String> = (0..100).map(|i| format!("\"k{i}\": 0")).collect();
    fails(&format!("{{\"o\": {{{}}}}}", wide.join(",")), "o", "keys");
}

#[test]
fn every_truncation_is_an_error() {
    let text = r#"{"a": [1.5, true, null, {"b": "é\u00e9"}], "c": -2e-3}"#;
    assert!(Json::parse(text).is_ok());
    for (i, _) in text.char_indices() {
        assert!(Json::parse(&text[..i]).is_err(), "{}", &text[..i]);
    }
}
