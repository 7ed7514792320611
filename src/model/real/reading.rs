//! Finding, for a number that is known only by its type, what somebody outside this crate has written for all numbers.

use std::any::{Any, TypeId};

/// A value for each kind of number, by the number's type: all that evaluate, differentiate and trace.
pub(crate) type Readings = fn(TypeId) -> Option<Box<dyn Any>>;

/// What `readings` have for the number `R`.
///
/// # Panics
/// If `R` is none of the kinds of number that servobee itself uses.
pub(crate) fn reading<R: 'static, T: 'static>(readings: Readings) -> T {
    let found = readings(TypeId::of::<R>()).and_then(|value| value.downcast().ok());
    *found.expect("a kind of number that equations from outside are read with")
}

/// `$value`, in which `$R` stands for the number whose type has `$id`.
macro_rules! for_number {
    ($id:expr, $R:ident => $value:expr) => {{
        #[cfg(target_arch = "x86_64")]
        $crate::model::real::reading::for_each!($id, $R => $value,
            $crate::model::real::Lanes<f32, pulp::x86::V4>,
            $crate::model::real::Lanes<f64, pulp::x86::V4>,
            $crate::model::real::Lanes<f32, pulp::x86::V3>,
            $crate::model::real::Lanes<f64, pulp::x86::V3>,
            $crate::model::real::Dual<pulp::x86::V4>,
            $crate::model::real::Dual<pulp::x86::V3>
        );
        #[cfg(target_arch = "aarch64")]
        $crate::model::real::reading::for_each!($id, $R => $value,
            $crate::model::real::Lanes<f32, pulp::aarch64::Neon>,
            $crate::model::real::Lanes<f64, pulp::aarch64::Neon>,
            $crate::model::real::Dual<pulp::aarch64::Neon>
        );
        $crate::model::real::reading::for_each!($id, $R => $value,
            f64,
            f32,
            $crate::model::real::Dual<pulp::Scalar>,
            $crate::model::real::Traced
        );
        None
    }};
}
macro_rules! for_each {
    ($id:expr, $R:ident => $value:expr, $($number:ty),*) => {$(
        {
            type $R = $number;
            if $id == std::any::TypeId::of::<$R>() {
                let value: Box<dyn std::any::Any> = Box::new($value);
                return Some(value);
            }
        }
    )*};
}
pub(crate) use {for_each, for_number};
