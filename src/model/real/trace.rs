//! Reading an equation as text: operations are recorded on a tape and written out in another language.

mod c;
mod modelica;
mod reserved;
mod wgsl;

pub use c::C;
pub use modelica::Modelica;
pub(crate) use reserved::{OTHER_NAME, is_writable, not_writable};
pub use wgsl::Wgsl;

use super::Real;
use std::cell::RefCell;
use std::collections::{BTreeSet, HashMap};
use std::marker::PhantomData;
use std::ops::{Add, Div, Mul, Neg, Sub};

/// A number of the text: an entry on this thread's tape.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Traced(usize);

#[derive(Debug, Clone, PartialEq, Eq, Hash)]
enum Operation {
    /// A literal, by its bits.
    Constant(u64),
    /// An expression that reads something, such as `state.spool`.
    Read(String),
    Unary(&'static str, Traced),
    Infix(char, Traced, Traced),
    Call(&'static str, Traced, Traced),
    /// The second where the first is above zero, otherwise the third.
    Select(Traced, Traced, Traced),
}

impl Operation {
    fn arguments(&self) -> Vec<Traced> {
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
    names: HashMap<Traced, String>,
    known: HashMap<Operation, Traced>,
}

thread_local! {
    static TAPE: RefCell<Tape> = RefCell::default();
}

fn record(operation: Operation) -> Traced {
    TAPE.with_borrow_mut(|tape| {
        if let Some(&known) = tape.known.get(&operation) {
            return known;
        }
        let number = Traced(tape.operations.len());
        tape.operations.push(operation.clone());
        tape.known.insert(operation, number);
        number
    })
}

impl Add for Traced {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        record(Operation::Infix('+', self, other))
    }
}

impl Sub for Traced {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        record(Operation::Infix('-', self, other))
    }
}

impl Mul for Traced {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        record(Operation::Infix('*', self, other))
    }
}

impl Div for Traced {
    type Output = Self;
    fn div(self, other: Self) -> Self {
        record(Operation::Infix('/', self, other))
    }
}

impl Neg for Traced {
    type Output = Self;
    fn neg(self) -> Self {
        record(Operation::Unary("-", self))
    }
}

impl Real for Traced {
    fn constant(value: f64) -> Self {
        record(Operation::Constant(value.to_bits()))
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

/// How a language writes numbers, and what it reads them from.
pub trait Language {
    /// A literal; a negative one so that a minus sign may stand before it.
    fn literal(value: f64) -> String;
    /// `yes` where `value` is above zero, otherwise `no`.
    fn choice(value: &str, yes: &str, no: &str) -> String;
    /// What reads the number that is recorded as `expression`.
    fn read(expression: &str) -> String {
        expression.into()
    }
    /// The name of a number that people have called `name`.
    fn label(name: String) -> String {
        name
    }
}

/// The text of a function: what it reads, its local numbers, and its results.
#[derive(Debug)]
pub struct Body {
    /// The expressions that it reads, `plant.*` among them.
    pub reads: BTreeSet<String>,
    /// Name and expression of each local number, in order.
    pub locals: Vec<(String, String)>,
    /// The expressions of the results.
    pub results: Vec<String>,
}

/// A recording. The numbers recorded before [`Trace::seal`] are computed once a candidate and become fields of a
/// `Plant`; the functions recorded afterwards read them from there.
#[derive(Debug)]
pub struct Trace {
    sealed: usize,
    fields: BTreeSet<Traced>,
    reads: BTreeSet<String>,
}

impl Trace {
    /// Starts a recording on this thread; an earlier one is forgotten.
    pub fn start() -> Self {
        TAPE.set(Tape::default());
        Self {
            sealed: 0,
            fields: BTreeSet::new(),
            reads: BTreeSet::new(),
        }
    }

    /// A number that is read with `expression`.
    pub fn read(&self, expression: impl Into<String>) -> Traced {
        record(Operation::Read(expression.into()))
    }

    /// Names a number whatever it is, so that people recognise it as a field of the plant.
    pub fn name(&self, number: Traced, name: &str) {
        TAPE.with_borrow_mut(|tape| tape.names.insert(number, name.to_owned()));
    }

    /// Ends the part that is computed once a candidate.
    pub fn seal(&mut self) {
        self.sealed = TAPE.with_borrow(|tape| tape.operations.len());
    }

    /// Writes a function that may read `plant.*`.
    pub fn function<L: Language>(&mut self, results: &[Traced]) -> Body {
        TAPE.with_borrow(|tape| self.write::<L>(tape, results, self.sealed))
    }

    /// Writes all fields of `Plant` as results of the function that prepares it, and their names. Last, since only now is
    /// it known which of them the other functions read.
    pub fn plant<L: Language>(&mut self) -> (Vec<String>, Body) {
        let fields: Vec<Traced> = self.fields.iter().copied().collect();
        TAPE.with_borrow(|tape| {
            let names = fields.iter().map(|&field| L::label(tape.label(field)));
            (names.collect(), self.write::<L>(tape, &fields, 0))
        })
    }

    /// Whether any function that was written reads `expression`.
    pub fn has_read(&self, expression: &str) -> bool {
        self.reads.contains(expression)
    }

    fn write<L: Language>(&mut self, tape: &Tape, results: &[Traced], sealed: usize) -> Body {
        let mut writer = Writer::<L> {
            tape,
            sealed,
            uses: HashMap::new(),
            language: PhantomData,
        };
        for &result in results {
            writer.count(result);
        }
        let mut shared: Vec<Traced> = writer
            .uses
            .keys()
            .copied()
            .filter(|&n| writer.is_local(n))
            .collect();
        shared.sort();
        let used = || writer.uses.keys().copied();
        self.fields.extend(used().filter(|&n| writer.is_field(n)));
        let read = |n: Traced| match &tape.operations[n.0] {
            _ if writer.is_field(n) => Some(format!("plant.{}", writer.label(n))),
            Operation::Read(expression) => Some(expression.clone()),
            _ => None,
        };
        let reads: BTreeSet<String> = used().filter_map(read).collect();
        self.reads.extend(reads.iter().cloned());
        Body {
            reads,
            locals: shared
                .into_iter()
                .map(|number| (writer.label(number), writer.expression(number, true)))
                .collect(),
            results: results
                .iter()
                .map(|&result| strip(&writer.reference(result)).to_owned())
                .collect(),
        }
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
    fn label(&self, number: Traced) -> String {
        match self.names.get(&number) {
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

struct Writer<'a, L> {
    tape: &'a Tape,
    sealed: usize,
    uses: HashMap<Traced, usize>,
    language: PhantomData<L>,
}

impl<L: Language> Writer<'_, L> {
    fn count(&mut self, number: Traced) {
        let uses = self.uses.entry(number).or_insert(0);
        *uses += 1;
        if *uses == 1 && !self.is_field(number) {
            for argument in self.tape.operations[number.0].arguments() {
                self.count(argument);
            }
        }
    }

    /// Whether a number is computed once a candidate and read from the plant.
    fn is_field(&self, number: Traced) -> bool {
        number.0 < self.sealed && !matches!(self.tape.operations[number.0], Operation::Constant(_))
    }

    /// Whether a number gets a line of its own: it has a name or several users.
    fn is_local(&self, number: Traced) -> bool {
        !self.is_field(number)
            && !matches!(
                self.tape.operations[number.0],
                Operation::Constant(_) | Operation::Read(_)
            )
            && (self.uses[&number] > 1 || self.tape.names.contains_key(&number))
    }

    fn label(&self, number: Traced) -> String {
        L::label(self.tape.label(number))
    }

    fn reference(&self, number: Traced) -> String {
        if self.is_field(number) {
            L::read(&format!("plant.{}", self.label(number)))
        } else if self.is_local(number) {
            self.label(number)
        } else {
            self.expression(number, false)
        }
    }

    fn expression(&self, number: Traced, outermost: bool) -> String {
        let text = match &self.tape.operations[number.0] {
            Operation::Constant(bits) => return L::literal(f64::from_bits(*bits)),
            Operation::Read(expression) => return L::read(expression),
            Operation::Unary("-", a) => format!("(-{})", self.reference(*a)),
            Operation::Unary(name, a) => return format!("{name}({})", strip(&self.reference(*a))),
            Operation::Call(name, a, b) => {
                let (a, b) = (self.reference(*a), self.reference(*b));
                return format!("{name}({}, {})", strip(&a), strip(&b));
            }
            Operation::Select(a, yes, no) => {
                let [a, yes, no] = [a, yes, no].map(|&number| self.reference(number));
                return L::choice(&a, strip(&yes), strip(&no));
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
