//! Reading an equation as WGSL: operations are recorded on a tape and written out as shader functions.

use super::Real;
use std::cell::RefCell;
use std::collections::{BTreeSet, HashMap};
use std::fmt::Write;
use std::ops::{Add, Div, Mul, Neg, Range, Sub};

/// A number of the shader: an entry on this thread's tape.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Wgsl(usize);

#[derive(Debug, Clone, PartialEq, Eq, Hash)]
enum Operation {
    /// A literal, by the bits of its `f32` value.
    Constant(u32),
    /// An expression that reads something, such as `state.spool`.
    Read(String),
    Unary(&'static str, Wgsl),
    Infix(char, Wgsl, Wgsl),
    Call(&'static str, Wgsl, Wgsl),
    /// The second where the first is above zero, otherwise the third.
    Select(Wgsl, Wgsl, Wgsl),
}

impl Operation {
    fn arguments(&self) -> Vec<Wgsl> {
        match self {
            Self::Constant(_) | Self::Read(_) => vec![],
            Self::Unary(_, a) => vec![*a],
            Self::Infix(_, a, b) | Self::Call(_, a, b) => vec![*a, *b],
            Self::Select(a, yes, no) => vec![*a, *yes, *no],
        }
    }
}

#[derive(Default)]
struct Tape {
    operations: Vec<Operation>,
    names: HashMap<Wgsl, String>,
    known: HashMap<Operation, Wgsl>,
}

thread_local! {
    static TAPE: RefCell<Tape> = RefCell::default();
}

fn record(operation: Operation) -> Wgsl {
    TAPE.with_borrow_mut(|tape| {
        if let Some(&known) = tape.known.get(&operation) {
            return known;
        }
        let number = Wgsl(tape.operations.len());
        tape.operations.push(operation.clone());
        tape.known.insert(operation, number);
        number
    })
}

impl Add for Wgsl {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        record(Operation::Infix('+', self, other))
    }
}

impl Sub for Wgsl {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        record(Operation::Infix('-', self, other))
    }
}

impl Mul for Wgsl {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        record(Operation::Infix('*', self, other))
    }
}

impl Div for Wgsl {
    type Output = Self;
    fn div(self, other: Self) -> Self {
        record(Operation::Infix('/', self, other))
    }
}

impl Neg for Wgsl {
    type Output = Self;
    fn neg(self) -> Self {
        record(Operation::Unary("-", self))
    }
}

impl Real for Wgsl {
    fn constant(value: f64) -> Self {
        record(Operation::Constant((value as f32).to_bits()))
    }
    fn sqrt(self) -> Self {
        record(Operation::Unary("sqrt", self))
    }
    fn min(self, other: Self) -> Self {
        record(Operation::Call("min", self, other))
    }
    fn max(self, other: Self) -> Self {
        record(Operation::Call("max", self, other))
    }
    fn floor(self) -> Self {
        record(Operation::Unary("floor", self))
    }
    fn if_positive(self, yes: Self, no: Self) -> Self {
        record(Operation::Select(self, yes, no))
    }
    fn any_positive(self) -> bool {
        true
    }
    fn named(self, name: &str) -> Self {
        TAPE.with_borrow_mut(|tape| {
            if !matches!(
                tape.operations[self.0],
                Operation::Read(_) | Operation::Constant(_)
            ) {
                tape.names.entry(self).or_insert_with(|| name.to_owned());
            }
        });
        self
    }
}

/// A recording. The numbers recorded before [`Trace::seal`] are computed once a candidate and become fields of the
/// shader's `Plant`; the functions recorded afterwards read them from there.
pub struct Trace {
    sealed: Range<usize>,
    fields: BTreeSet<Wgsl>,
}

/// A shader function to be written: its signature, and its results in the order of the constructor that returns them.
pub struct Function<'a> {
    /// Everything between `fn ` and `{`.
    pub signature: &'a str,
    /// What builds the return value, such as `State` or `vec3<f32>`.
    pub constructor: &'a str,
    /// The values that it is built from.
    pub results: &'a [Wgsl],
}

impl Trace {
    /// Starts a recording on this thread; an earlier one is forgotten.
    pub fn start() -> Self {
        TAPE.set(Tape::default());
        Self {
            sealed: 0..0,
            fields: BTreeSet::new(),
        }
    }

    /// A number that the shader reads with `expression`.
    pub fn read(&self, expression: impl Into<String>) -> Wgsl {
        record(Operation::Read(expression.into()))
    }

    /// Names a number whatever it is, so that people recognise it as a field of the plant.
    pub fn name(&self, number: Wgsl, name: &str) {
        TAPE.with_borrow_mut(|tape| tape.names.insert(number, name.to_owned()));
    }

    /// Ends the part that is computed once a candidate.
    pub fn seal(&mut self) {
        self.sealed = 0..TAPE.with_borrow(|tape| tape.operations.len());
    }

    /// Writes a function that may read `plant.*`.
    pub fn function(&mut self, function: &Function) -> String {
        TAPE.with_borrow(|tape| self.write(tape, function, true))
    }

    /// Writes the struct `Plant` and the function that prepares it. Last, since only now is it known which fields the
    /// other functions read.
    pub fn plant(&mut self, signature: &str) -> String {
        let fields: Vec<Wgsl> = self.fields.iter().copied().collect();
        TAPE.with_borrow(|tape| {
            let mut text = String::from("struct Plant {\n");
            for &field in &fields {
                writeln!(text, "    {}: f32,", tape.label(field)).expect("writing to a string");
            }
            if fields.is_empty() {
                text.push_str("    unused: f32,\n");
            }
            text.push_str("}\n\n");
            let nothing = [Wgsl(usize::MAX)];
            let results = if fields.is_empty() {
                &nothing[..]
            } else {
                &fields
            };
            text + &self.write(
                tape,
                &Function {
                    signature,
                    constructor: "Plant",
                    results,
                },
                false,
            )
        })
    }

    fn write(&mut self, tape: &Tape, function: &Function, reads_plant: bool) -> String {
        let mut writer = Writer {
            tape,
            sealed: if reads_plant { self.sealed.end } else { 0 },
            uses: HashMap::new(),
        };
        for &result in function.results {
            writer.count(result);
        }
        let mut text = format!("fn {} {{\n", function.signature);
        let mut shared: Vec<Wgsl> = writer
            .uses
            .keys()
            .copied()
            .filter(|&n| writer.is_let(n))
            .collect();
        shared.sort();
        for number in shared {
            let expression = writer.expression(number, true);
            writeln!(text, "    let {} = {expression};", tape.label(number))
                .expect("writing to a string");
        }
        let results: Vec<String> = function
            .results
            .iter()
            .map(|&r| writer.reference(r))
            .collect();
        let results: Vec<&str> = results.iter().map(|r| strip(r)).collect();
        if reads_plant {
            self.fields
                .extend(writer.uses.keys().filter(|&&n| writer.is_field(n)));
        }
        write!(
            text,
            "    return {}({});\n}}\n",
            function.constructor,
            results.join(", ")
        )
        .expect("writing to a string");
        text
    }
}

/// An expression without the parentheses that enclose the whole of it.
fn strip(expression: &str) -> &str {
    let inner = expression
        .strip_prefix('(')
        .and_then(|e| e.strip_suffix(')'));
    let Some(inner) = inner else {
        return expression;
    };
    let mut depth = 0i32;
    for character in inner.chars() {
        depth += match character {
            '(' => 1,
            ')' => -1,
            _ => 0,
        };
        if depth < 0 {
            return expression;
        }
    }
    inner
}

impl Tape {
    /// A name that is unique on the tape.
    fn label(&self, number: Wgsl) -> String {
        match self.names.get(&number) {
            None if number.0 == usize::MAX => "unused".into(),
            None => format!("t{}", number.0),
            Some(name) => {
                let clash = self
                    .names
                    .iter()
                    .any(|(n, other)| *n < number && other == name);
                if clash {
                    format!("{name}_{}", number.0)
                } else {
                    name.clone()
                }
            }
        }
    }
}

struct Writer<'a> {
    tape: &'a Tape,
    sealed: usize,
    uses: HashMap<Wgsl, usize>,
}

impl Writer<'_> {
    fn count(&mut self, number: Wgsl) {
        let uses = self.uses.entry(number).or_insert(0);
        *uses += 1;
        if *uses == 1 && number.0 != usize::MAX && !self.is_field(number) {
            for argument in self.tape.operations[number.0].arguments() {
                self.count(argument);
            }
        }
    }

    /// Whether a number is computed once a candidate and read from the plant.
    fn is_field(&self, number: Wgsl) -> bool {
        number.0 < self.sealed && !matches!(self.tape.operations[number.0], Operation::Constant(_))
    }

    /// Whether a number gets a line of its own: it has a name or several users.
    fn is_let(&self, number: Wgsl) -> bool {
        number.0 != usize::MAX
            && !self.is_field(number)
            && !matches!(
                self.tape.operations[number.0],
                Operation::Constant(_) | Operation::Read(_)
            )
            && (self.uses[&number] > 1 || self.tape.names.contains_key(&number))
    }

    fn reference(&self, number: Wgsl) -> String {
        if number.0 == usize::MAX {
            "0.0".into()
        } else if self.is_field(number) {
            format!("plant.{}", self.tape.label(number))
        } else if self.is_let(number) {
            self.tape.label(number)
        } else {
            self.expression(number, false)
        }
    }

    fn expression(&self, number: Wgsl, outermost: bool) -> String {
        let text = match &self.tape.operations[number.0] {
            Operation::Constant(bits) => return literal(f32::from_bits(*bits)),
            Operation::Read(expression) => return expression.clone(),
            Operation::Unary("-", a) => format!("(-{})", self.reference(*a)),
            Operation::Unary(name, a) => return format!("{name}({})", strip(&self.reference(*a))),
            Operation::Call(name, a, b) => {
                let (a, b) = (self.reference(*a), self.reference(*b));
                return format!("{name}({}, {})", strip(&a), strip(&b));
            }
            Operation::Select(a, yes, no) => {
                let [a, yes, no] = [a, yes, no].map(|&number| self.reference(number));
                return format!("select({}, {}, {a} > 0.0)", strip(&no), strip(&yes));
            }
            Operation::Infix(sign, a, b) => {
                format!("({} {sign} {})", self.reference(*a), self.reference(*b))
            }
        };
        if outermost {
            strip(&text).to_owned()
        } else {
            text
        }
    }
}

/// The shortest decimal that gives back the same `f32`; a negative one in parentheses, since `a--b` is no WGSL.
fn literal(value: f32) -> String {
    if value < 0.0 {
        format!("({value:?}f)")
    } else {
        format!("{value:?}f")
    }
}
