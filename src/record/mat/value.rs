//! The arrays of a MAT file.

use super::element::{COMPRESSED, INT32, MATRIX, Read5, Reader, UINT32, damaged};

/// Deepest nesting of structs and cells that is followed.
const DEEPEST: usize = 32;

/// Accounted for each array, beside its numbers.
const OVERHEAD: usize = 128;

/// What a variable or a field holds.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Value {
    /// Real numbers column by column, whatever their class; their sizes are `sizes`.
    Numbers {
        sizes: Vec<usize>,
        values: Vec<f64>,
    },
    Text(String),
    /// The elements of an array of structs; one for a plain struct. They have the same fields.
    Structs(Vec<Fields>),
    Cells(Vec<Value>),
    /// An object of the class that is named. Its content stands in a part of the file that is not documented.
    Object(String),
    /// What it is that cannot be read as numbers.
    Other(&'static str),
}

/// Fields by their names.
pub(super) type Fields = Vec<(String, Value)>;

/// The variables in `bytes`, which follow the file's header. Errors carry the name of the variable, once it is known.
pub(super) fn variables(
    reader: &mut Reader,
    mut bytes: &[u8],
) -> std::result::Result<Fields, (Option<String>, super::element::Fault)> {
    let mut variables = Fields::new();
    let mut name = None;
    loop {
        let element = match reader.next(&mut bytes) {
            Ok(None) => return Ok(variables),
            Ok(Some(element)) => element,
            Err(fault) => return Err((None, fault)),
        };
        let read = match element.kind {
            MATRIX => array(reader, element.bytes, 0, &mut name),
            COMPRESSED => reader.inflated(element.bytes).and_then(|content| {
                let read = array(reader, &content, 0, &mut name);
                reader.release(content.len());
                read
            }),
            _ => Err(damaged("it holds something that is no array")),
        };
        let value = read.map_err(|fault| (name.take(), fault))?;
        // The variable without a name is where MATLAB keeps the content of objects.
        if let Some(name) = name.take().filter(|name| !name.is_empty()) {
            variables.push((name, value));
        }
    }
}

/// The array in `bytes`, and its `name` as soon as it is read.
fn array(
    reader: &mut Reader,
    mut bytes: &[u8],
    depth: usize,
    name: &mut Option<String>,
) -> Read5<Value> {
    reader.allocate(OVERHEAD)?;
    if depth > DEEPEST {
        return Err(damaged("its structs are nested without end"));
    }
    let bytes = &mut bytes;
    // An empty field has no content at all.
    let Some(flags) = reader.next(bytes)? else {
        return Ok(Value::Numbers {
            sizes: vec![0, 0],
            values: Vec::new(),
        });
    };
    if flags.kind != UINT32 || flags.bytes.len() != 8 {
        return Err(damaged("it has no array flags"));
    }
    let flags = reader.numbers(flags)?[0] as u32;
    let (class, complex) = (flags & 0xff, flags & 0x800 != 0);
    const OPAQUE: u32 = 17;
    if class == OPAQUE {
        *name = Some(word(text(reader, bytes, "name")?)?);
        text(reader, bytes, "type")?;
        return Ok(Value::Object(word(text(reader, bytes, "class")?)?));
    }
    let sizes = reader.needed(bytes, "size")?;
    if sizes.kind != INT32 || sizes.bytes.len() < 8 {
        return Err(damaged("it has no size"));
    }
    let sizes = reader.numbers(sizes)?;
    *name = Some(word(text(reader, bytes, "name")?)?);
    if sizes.iter().any(|&size| size < 0.0) {
        return Err(damaged("its size is negative"));
    }
    let sizes: Vec<usize> = sizes.into_iter().map(|size| size as usize).collect();
    let count = sizes
        .iter()
        .try_fold(1_usize, |count, &size| count.checked_mul(size))
        .ok_or_else(|| damaged("its size is beyond all bounds"))?;
    match class {
        1 => cells(reader, bytes, count, depth),
        2 => structs(reader, bytes, count, depth),
        3 => Ok(Value::Object(word(text(reader, bytes, "class")?)?)),
        4 => characters(reader, bytes, &sizes),
        5 => Ok(Value::Other("a sparse matrix")),
        6..=15 if complex => Ok(Value::Other("complex numbers")),
        6..=15 => {
            let values = reader.needed(bytes, "numbers")?;
            let values = reader.numbers(values)?;
            match values.len() == count {
                true => Ok(Value::Numbers { sizes, values }),
                false => Err(damaged("it has not as many numbers as it says")),
            }
        }
        16 => Ok(Value::Other("a function handle")),
        _ => Err(damaged("its class is not known")),
    }
}

fn text(reader: &mut Reader, bytes: &mut &[u8], what: &str) -> Read5<String> {
    let element = reader.needed(bytes, what)?;
    reader.text(element)
}

/// `text` as the name of something: MATLAB's have up to 63 characters, and none that cannot be seen.
fn word(text: String) -> Read5<String> {
    const LONGEST: usize = 1000;
    match text.len() > LONGEST || text.contains(char::is_control) {
        true => Err(damaged("it has a name that is none")),
        false => Ok(text),
    }
}

fn characters(reader: &mut Reader, bytes: &mut &[u8], sizes: &[usize]) -> Read5<Value> {
    let Some(element) = reader.next(bytes)? else {
        return Ok(Value::Text(String::new()));
    };
    let text = reader.text(element)?;
    match sizes {
        [0 | 1, _] | [_, 0] => Ok(Value::Text(text)),
        _ => Ok(Value::Other("text of several rows")),
    }
}

fn cells(reader: &mut Reader, bytes: &mut &[u8], count: usize, depth: usize) -> Read5<Value> {
    let mut cells = Vec::new();
    for cell in 1..=count {
        let within = |fault: super::element::Fault| fault.within(&format!("{{{cell}}}"));
        cells.push(element(reader, bytes, depth).map_err(within)?);
    }
    Ok(Value::Cells(cells))
}

fn structs(reader: &mut Reader, bytes: &mut &[u8], count: usize, depth: usize) -> Read5<Value> {
    let length = reader.needed(bytes, "length of names")?;
    let length = reader.numbers(length)?.first().copied().unwrap_or(0.0) as usize;
    let names = reader.needed(bytes, "names of fields")?;
    if length == 0 || names.bytes.is_empty() {
        return Ok(Value::Structs(Vec::new()));
    }
    reader.allocate(names.bytes.len().div_ceil(length).saturating_mul(OVERHEAD))?;
    let names: Vec<String> = names
        .bytes
        .chunks(length)
        .map(|name| {
            let end = name.iter().position(|&byte| byte == 0);
            word(String::from_utf8_lossy(&name[..end.unwrap_or(name.len())]).into_owned())
        })
        .collect::<Read5<_>>()?;
    let mut structs = Vec::new();
    for _ in 0..count {
        let mut fields = Fields::new();
        for name in &names {
            let value = element(reader, bytes, depth).map_err(|fault| fault.within(name))?;
            reader.allocate(name.len())?;
            fields.push((name.clone(), value));
        }
        structs.push(fields);
    }
    Ok(Value::Structs(structs))
}

/// The array that is the next element.
fn element(reader: &mut Reader, bytes: &mut &[u8], depth: usize) -> Read5<Value> {
    let element = reader.needed(bytes, "content")?;
    match element.kind {
        MATRIX => array(reader, element.bytes, depth + 1, &mut None),
        _ => Err(damaged("it holds something that is no array")),
    }
}
