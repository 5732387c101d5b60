//! Loops compiled twice: for any machine, and for one with wide vectors.

/// Defines a function whose body is compiled for AVX2 and fused multiply-add too, where the machine has
/// them. The same bits either way: what is fused is fused by name. The body should be small or call
/// functions that are always inlined. It may have many arguments: a loop is quickest over plain ones.
macro_rules! vectorized {
    ($(#[$meta:meta])* $visible:vis fn $name:ident[$($generics:tt)*]($($arg:ident: $ty:ty),* $(,)?)
        $(-> $out:ty)? $body:block
    ) => {
        $(#[$meta])*
        #[allow(clippy::too_many_arguments)]
        $visible fn $name<$($generics)*>($($arg: $ty),*) $(-> $out)? {
            #[inline(always)]
            #[allow(clippy::too_many_arguments)]
            fn any<$($generics)*>($($arg: $ty),*) $(-> $out)? $body

            #[cfg(target_arch = "x86_64")]
            {
                #[target_feature(enable = "avx2,fma")]
                #[allow(clippy::too_many_arguments)]
                fn wide<$($generics)*>($($arg: $ty),*) $(-> $out)? {
                    any($($arg),*)
                }
                if std::is_x86_feature_detected!("avx2") && std::is_x86_feature_detected!("fma") {
                    // SAFETY: the features were just detected.
                    return unsafe { wide($($arg),*) };
                }
            }
            any($($arg),*)
        }
    };
}
pub(crate) use vectorized;
