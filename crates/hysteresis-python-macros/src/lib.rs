//! `#[function]` and `#[methods]`: each parameter is said once, where Rust has it.
//!
//! ```ignore
//! /// A sine.
//! #[function]
//! fn sine<'py>(
//!     py: Python<'py>,
//!     amplitude: f64,
//!     #[py(*)] seconds: f64,                                            // from here on by name only
//!     #[py(= 10000.0)] rate: f64,                                       // with a default
//!     #[py("Literal['linear', 'logarithmic']" = "linear")] sweep: Sweep, // with a type that Rust does not tell
//! ) -> PyResult<Bound<'py, PyArray1<f64>>> { ... }
//! ```
//!
//! is a `#[pyfunction]` with the signature that `help` shows. Each argument comes as any object of Python and is
//! converted by `Argument` of its Rust type, which gets its name: an error tells it. The default that is written is the
//! one that takes effect: it is converted like an argument. Objects of Python and options of them (`&Bound<'_, PyAny>`)
//! are handed on as they are, and have no default but None: another one would have to be written again where it takes
//! effect.
//!
//! None that is given stands for the default, unless it is a value of the type, or the parameter says `not_none`.
//!
//! A new option of a call is one such line where the options are gathered: of a function with
//! `#[gather(options: Options)]` the parameters with `#[py(field, ...)]` set fields of the value `options`. There the
//! default that takes effect is that of `Options`, or of the value behind `=` in
//! `#[gather(options: Options = Options::new(dt))]`. What is written is only shown, as Python needs it as text;
//! `argument::Shown` has the comparison of each pair, which a test makes.
//!
//! `#[methods]` stands in place of `#[pymethods]` and does the same for all methods of a block. `#[methods(A, B)]`
//! gives the block to several classes: what they share is written once. A method with `#[like(step)]` has the
//! parameters of `step`.
//!
//! `#[copies(Other)]` at a class copies the fields of a struct of another crate, each of which the class has.
//!
//! `#[py(-> "type")]` at a function says its result where Rust does not, and `#[py("type")]` at `impl Argument for T`
//! what every parameter of the type T takes. Only the stub, which the build script of the binding writes, reads them.

mod signature;

use proc_macro::TokenStream;
use quote::{ToTokens, format_ident, quote};
use signature::{Kind, Parameter, arguments, fill_alike, last_name, list, parameters, python_default};
use syn::parse::{Parse, ParseStream};
use syn::punctuated::Punctuated;
use syn::{Attribute, Expr, FnArg, Ident, ImplItem, ItemFn, ItemImpl, Lit, Signature, Stmt, Token, Type, parse_quote};

/// A function of the module.
#[proc_macro_attribute]
pub fn function(_: TokenStream, item: TokenStream) -> TokenStream {
    let mut function = syn::parse_macro_input!(item as ItemFn);
    let name = function.sig.ident.to_string();
    let done = converted(&name, Kind::Function, &mut function.attrs, &mut function.sig).map(|done| {
        function.block.stmts.splice(0..0, done.conversions);
        let shown = done.shown;
        quote!(#[pyo3::pyfunction] #function #shown)
    });
    done.unwrap_or_else(|error| error.to_compile_error()).into()
}

/// Methods of a class, or of each of several classes.
#[proc_macro_attribute]
pub fn methods(classes: TokenStream, item: TokenStream) -> TokenStream {
    let classes = syn::parse_macro_input!(classes with Punctuated::<Ident, Token![,]>::parse_terminated);
    let mut block = syn::parse_macro_input!(item as ItemImpl);
    if let Err(error) = fill_alike(&mut block) {
        return error.to_compile_error().into();
    }
    let ty = block.self_ty.clone();
    let class = last_name(&ty).unwrap_or_default();
    let mut shown = Vec::new();
    for item in &mut block.items {
        let ImplItem::Fn(method) = item else { continue };
        let name = format!("{class}.{}", method.sig.ident);
        match converted(&name, Kind::of(method), &mut method.attrs, &mut method.sig) {
            Ok(done) => {
                method.block.stmts.splice(0..0, done.conversions);
                shown.extend(done.shown);
                if let Some(beside) = done.beside {
                    shown.push(quote!(impl #ty { #beside }));
                }
            }
            Err(error) => return error.to_compile_error().into(),
        }
    }
    if classes.is_empty() {
        return quote!(#[pyo3::pymethods] #block #(#shown)*).into();
    }
    let each = classes.iter().map(|class| {
        block.self_ty = parse_quote!(#class);
        quote!(#[pyo3::pymethods] #block)
    });
    quote!(#(#each)* #(#shown)*).into()
}

/// `#[py("type")] impl Argument for T`: the Python type of what a T is made from.
#[proc_macro_attribute]
pub fn py(_: TokenStream, item: TokenStream) -> TokenStream {
    item
}

/// What stands at the beginning of a function, and beside it.
struct Converted {
    /// The statements that convert what came.
    conversions: Vec<Stmt>,
    /// The comparison of the defaults that are shown with those that take effect.
    shown: Option<proc_macro2::TokenStream>,
    /// An item for the same class.
    beside: Option<proc_macro2::TokenStream>,
}

/// `#[copies(Other)]` of a class: it has the fields of the other struct, under the same names.
#[proc_macro_attribute]
pub fn copies(other: TokenStream, item: TokenStream) -> TokenStream {
    let other = syn::parse_macro_input!(other as syn::Path);
    let class = syn::parse_macro_input!(item as syn::ItemStruct);
    let name = &class.ident;
    let fields: Vec<_> = class.fields.iter().map(|field| &field.ident).collect();
    quote! {
        #class

        impl From<#other> for #name {
            fn from(other: #other) -> Self {
                Self { #(#fields: other.#fields),* }
            }
        }
    }
    .into()
}

/// Makes the attributes and parameters those of pyo3.
fn converted(
    called: &str,
    kind: Kind,
    attributes: &mut Vec<Attribute>,
    signature: &mut Signature,
) -> syn::Result<Converted> {
    let seen = parameters(signature)?;
    let gathered = attributes.iter().find(|attribute| attribute.path().is_ident("gather"));
    let gathered = gathered.map(Attribute::parse_args::<Gathered>).transpose()?;
    attributes.retain(|attribute| !["py", "overload", "gather"].iter().any(|name| attribute.path().is_ident(name)));
    // What Python calls for the package alone stays as pyo3 has it.
    let is_private = signature.ident.to_string().starts_with('_');
    let mut conversions = Vec::new();
    let mut waiting = gathered.as_ref();
    for parameter in &seen {
        let FnArg::Typed(typed) = &mut signature.inputs[parameter.place] else { continue };
        typed.attrs.retain(|attribute| !attribute.path().is_ident("py"));
        if is_private {
            continue;
        }
        if is_object(&parameter.ty) {
            match &parameter.default {
                Some(default) if python_default(default)? != "None" => {
                    let problem = "an object that is handed on as it came has no default but None: give it a type";
                    return Err(syn::Error::new_spanned(default, problem));
                }
                _ => continue,
            }
        }
        if parameter.field.is_some()
            && let Some(Gathered { name, ty, base, .. }) = waiting.take()
        {
            conversions.push(parse_quote! { let mut #name: #ty = #base; });
        }
        conversions.push(match &parameter.field {
            Some(field) => setting(parameter, field, gathered.as_ref())?,
            None => conversion(parameter),
        });
        let py = lifetime(&parameter.ty);
        *typed.ty = match parameter.default {
            Some(_) => parse_quote!(crate::argument::Given<'_, #py>),
            None => parse_quote!(&pyo3::Bound<#py, pyo3::PyAny>),
        };
    }
    let shown = gathered.as_ref().map(|gathered| shown(called, gathered, &seen)).transpose()?;
    let beside = gathered.as_ref().map_or(Ok(None), |gathered| turned_round(gathered, &seen))?;
    if beside.is_some() && kind == Kind::Function {
        return Err(syn::Error::new_spanned(&*signature, "a function has no class for an item beside it"));
    }
    if seen.is_empty() || is_private || matches!(kind, Kind::Getter | Kind::Setter | Kind::Magic) {
        return Ok(Converted { conversions, shown, beside });
    }
    let first = match kind {
        Kind::Method => Some("$self"),
        Kind::ClassMethod => Some("$cls"),
        _ => None,
    };
    let text = list(first, &seen, |parameter| match &parameter.default {
        Some(default) => Ok(format!("{}={}", parameter.name, python_default(default)?)),
        None => Ok(parameter.name.clone()),
    })?;
    let text = format!("({text})");
    let signature = list(None, &seen, |parameter| match &parameter.default {
        _ if parameter.is_rest => Ok(parameter.name.clone()),
        Some(_) => Ok(format!("{}={}", parameter.name, absent(&parameter.ty))),
        None => Ok(parameter.name.clone()),
    })?;
    let signature: proc_macro2::TokenStream = signature.parse()?;
    attributes.push(parse_quote!(#[pyo3(signature = (#signature), text_signature = #text)]));
    attributes.push(parse_quote!(#[allow(clippy::too_many_arguments, reason = "Python's list is as long as it is")]));
    Ok(Converted { conversions, shown, beside })
}

/// `#[gather(name: Type = base, put)]`: the options of which the parameters with `field` set a field, where they are
/// given. All else is as in the base, by default that of the type. `put` is a function beside the method that turns it
/// round: it puts the parameters that make given options into a dictionary. With `as NAMES` in its place a constant
/// beside the method has the names of these parameters.
struct Gathered {
    name: Ident,
    ty: syn::Path,
    base: Expr,
    round: Option<Round>,
}

/// What turns the gathering round.
enum Round {
    Put(Ident),
    Names(Ident),
}

impl Parse for Gathered {
    fn parse(input: ParseStream<'_>) -> syn::Result<Self> {
        let name = input.parse()?;
        input.parse::<Token![:]>()?;
        let ty = input.parse()?;
        let base = if input.peek(Token![=]) {
            input.parse::<Token![=]>()?;
            input.parse()?
        } else {
            parse_quote!(Default::default())
        };
        let mut round = None;
        if input.peek(Token![,]) {
            input.parse::<Token![,]>()?;
            round = Some(if input.peek(Token![as]) {
                input.parse::<Token![as]>()?;
                Round::Names(input.parse()?)
            } else {
                Round::Put(input.parse()?)
            });
        }
        Ok(Self { name, ty, base, round })
    }
}

/// Whether an argument is handed on as the object that it is.
fn is_object(ty: &Type) -> bool {
    match last_name(ty).as_deref() {
        // Objects of a class of the package are checked to be of it.
        Some("Bound" | "Py") => {
            arguments(ty).iter().any(|inner| last_name(inner).is_some_and(|name| name.starts_with("Py")))
        }
        Some("Option") => arguments(ty).first().is_some_and(|inner| is_object(inner)),
        _ => false,
    }
}

/// The lifetime of what a value holds of Python, if it has a name.
fn lifetime(ty: &Type) -> proc_macro2::TokenStream {
    let text = ty.to_token_stream().to_string();
    let named =
        text.split('\'').skip(1).map(|rest| rest.split(|c: char| !c.is_alphanumeric()).next().unwrap_or_default());
    let named = named.into_iter().find(|name| !name.is_empty()).map_or("'_".to_owned(), |name| format!("'{name}"));
    named.parse().expect("a lifetime")
}

/// What stands for an argument that is not given.
fn absent(ty: &Type) -> &'static str {
    match last_name(ty).as_deref() {
        Some("Option") if is_object(ty) => "None",
        _ => "crate::argument::Given::Default",
    }
}

/// The statement that makes a value of what came.
fn conversion(parameter: &Parameter) -> Stmt {
    let Parameter { name: text, ty, default, .. } = parameter;
    let name = format_ident!("{text}");
    let or = format_ident!("{}", if parameter.refuses_none { "or_unless_given" } else { "or" });
    match default {
        None => parse_quote! { let #name: #ty = crate::argument::Argument::from_argument(#text, #name)?; },
        Some(default) => {
            let default = of_default(text, default, ty);
            parse_quote! { let #name: #ty = #name.#or(#text, || #default)?; }
        }
    }
}

/// The statement that sets a field to what came, if anything did.
fn setting(parameter: &Parameter, field: &str, gathered: Option<&Gathered>) -> syn::Result<Stmt> {
    let Parameter { name: text, ty, default, refuses_none, .. } = parameter;
    let Some(Gathered { name: options, .. }) = gathered else {
        return Err(syn::Error::new_spanned(ty, "a field of what? Say it by #[gather(options: Options)]"));
    };
    if default.is_none() || *refuses_none {
        return Err(syn::Error::new_spanned(ty, "a field shows its default, and None stands for it"));
    }
    let (name, field) = (format_ident!("{text}"), field.parse::<proc_macro2::TokenStream>()?);
    Ok(parse_quote! {
        if let Some(given) = #name.value::<#ty>(#text)? {
            #options.#field = given.into();
        }
    })
}

/// What turns the gathering round: the names of the parameters, or the function that puts them into a dictionary.
fn turned_round(gathered: &Gathered, seen: &[Parameter]) -> syn::Result<Option<proc_macro2::TokenStream>> {
    let ty = &gathered.ty;
    let put = match &gathered.round {
        None => return Ok(None),
        Some(Round::Names(constant)) => {
            let names = seen.iter().filter(|parameter| parameter.field.is_some()).map(|parameter| &parameter.name);
            return Ok(Some(quote!(const #constant: &[&'static str] = &[#(#names),*];)));
        }
        Some(Round::Put(put)) => put,
    };
    let mut each = Vec::new();
    for Parameter { name, field, .. } in seen {
        let Some(field) = field else { continue };
        let field = field.parse::<proc_macro2::TokenStream>()?;
        each.push(quote!(keywords.set_item(#name, crate::argument::AsArgument::as_argument(&options.#field, py)?)?;));
    }
    Ok(Some(quote! {
        pub(crate) fn #put(options: &#ty, keywords: &pyo3::Bound<'_, pyo3::types::PyDict>) -> pyo3::PyResult<()> {
            let py = keywords.py();
            #(#each)*
            Ok(())
        }
    }))
}

/// The default as an expression, a result of the type.
fn of_default(name: &str, default: &Expr, ty: &Type) -> proc_macro2::TokenStream {
    match default {
        Expr::Path(_) if last_name(ty).as_deref() != Some("Option") => {
            quote!(crate::argument::of_default(#name, None::<bool>))
        }
        default if is_of_type(default, ty) => quote!(Ok(#default)),
        default => quote!(crate::argument::of_default(#name, #default)),
    }
}

/// The comparison of the defaults of fields with those of the base.
fn shown(called: &str, gathered: &Gathered, seen: &[Parameter]) -> syn::Result<proc_macro2::TokenStream> {
    let Gathered { ty, base, .. } = gathered;
    // What the base is made of besides does not change the defaults.
    let used = base.to_token_stream().to_string();
    let used: Vec<&str> = used.split(|c: char| !(c.is_alphanumeric() || c == '_')).collect();
    let made_of = seen.iter().filter(|parameter| used.contains(&parameter.name.as_str()));
    let made_of = made_of.map(|Parameter { name, ty, .. }| {
        let name = format_ident!("{name}");
        quote!(let #name = <#ty>::default();)
    });
    let mut pairs = Vec::new();
    for Parameter { name, ty, default, field, .. } in seen {
        let (Some(default), Some(field)) = (default, field) else { continue };
        let (default, field) = (of_default(name, default, ty), field.parse::<proc_macro2::TokenStream>()?);
        pairs.push(quote! { (#name, crate::argument::is_shown::<#ty, _>(#default, &base.#field)) });
    }
    Ok(quote! {
        inventory::submit! {
            crate::argument::Shown {
                function: #called,
                defaults: || {
                    #(#made_of)*
                    let base: #ty = #base;
                    vec![#(#pairs),*]
                },
            }
        }
    })
}

/// Whether a default is of the type as it is written.
fn is_of_type(default: &Expr, ty: &Type) -> bool {
    let literal = match default {
        Expr::Lit(literal) => &literal.lit,
        Expr::Path(_) => return true,
        _ => return false,
    };
    match literal {
        Lit::Float(_) => last_name(ty).is_some_and(|name| name == "f64"),
        Lit::Bool(_) => last_name(ty).is_some_and(|name| name == "bool"),
        Lit::Int(_) => matches!(ty.to_token_stream().to_string().as_str(), "usize" | "u64" | "u32" | "i64"),
        _ => false,
    }
}
