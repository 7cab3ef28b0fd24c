"""Names that a function must not have in each language: keywords, built-in functions and types, library functions."""

import builtins
import keyword
import re

_MATH = """
acos acosh asin asinh atan atan2 atanh cbrt ceil copysign cos cosh erf erfc exp exp2 expm1 fabs fdim floor fma fmax fmin
fmod frexp hypot ilogb ldexp lgamma llrint llround log log10 log1p log2 logb lrint lround modf nan nearbyint nextafter
nexttoward pow remainder remquo rint round scalbln scalbn sin sinh sqrt tan tanh tgamma trunc
drem exp10 finite gamma isinf isnan j0 j1 jn lgamma_r lgammaf_r lgammal_r pow10 scalb significand sincos y0 y1 yn
cabs cacos cacosh carg casin casinh catan catanh ccos ccosh cexp cimag clog conj cpow cproj creal csin csinh csqrt ctan
ctanh
"""
"""Functions of math.h and complex.h (C17 7.12, 7.3), then those of the GNU C library; each also ends in f and l."""

_C = f"""
{_MATH} {" ".join(name + suffix for name in _MATH.split() for suffix in "fl")}
auto break case char const continue default do double else enum extern float for goto if inline int long register
restrict return short signed sizeof static struct switch typedef union unsigned void volatile while main alignas
alignof bool constexpr false nullptr static_assert thread_local true typeof typeof_unqual asm linux unix and and_eq
bitand bitor catch char16_t char32_t char8_t class co_await co_return co_yield compl concept const_cast consteval
constinit decltype delete dynamic_cast explicit export friend mutable namespace new noexcept not not_eq operator or
or_eq private protected public reinterpret_cast requires static_cast template this throw try typeid typename using
virtual wchar_t xor xor_eq FP_ILOGB0 FP_ILOGBNAN FP_INFINITE FP_NAN FP_NORMAL FP_SUBNORMAL FP_ZERO HUGE_VAL HUGE_VALF
HUGE_VALL INFINITY MATH_ERREXCEPT MATH_ERRNO M_1_PI M_2_PI M_2_SQRTPI M_E M_LN10 M_LN2 M_LOG10E M_LOG2E M_PI M_PI_2
M_PI_4 M_SQRT1_2 M_SQRT2 NAN double_t float_t fpclassify isfinite isgreater isgreaterequal isless islessequal
islessgreater isnormal isunordered math_errhandling signbit signgam abort abs aligned_alloc alloca asctime assert
at_quick_exit atexit atof atoi atol atoll bcmp bcopy bsearch btowc bzero c16rtomb c32rtomb calloc clearerr clock ctime
difftime div errno exit fclose feclearexcept fegetenv fegetexceptflag fegetround feholdexcept feof feraiseexcept
ferror fesetenv fesetexceptflag fesetround fetestexcept feupdateenv fflush ffs fgetc fgetpos fgets fgetwc fgetws fopen
fprintf fputc fputs fputwc fputws fread free freopen fscanf fseek fsetpos ftell fwide fwprintf fwrite fwscanf getc
getchar getenv gets getwc getwchar gmtime imaxabs imaxdiv index isalnum isalpha isascii isblank iscntrl isdigit
isgraph islower isprint ispunct isspace isupper iswalnum iswalpha iswblank iswcntrl iswctype iswdigit iswgraph
iswlower iswprint iswpunct iswspace iswupper iswxdigit isxdigit labs ldiv llabs lldiv localeconv localtime longjmp
malloc mblen mbrlen mbrtoc16 mbrtoc32 mbrtowc mbsinit mbsrtowcs mbstowcs mbtowc memchr memcmp memcpy memmove memset
mktime offsetof perror printf putc putchar puts putwc putwchar qsort quick_exit raise rand realloc remove rename
rewind rindex scanf setbuf setjmp setlocale setvbuf signal snprintf sprintf srand sscanf stderr stdin stdout strcat
strchr strcmp strcoll strcpy strcspn strdup strerror strftime strlen strncat strncmp strncpy strndup strpbrk strrchr
strspn strstr strtod strtof strtoimax strtok strtol strtold strtoll strtoul strtoull strtoumax strxfrm swprintf
swscanf system time timespec_get tmpfile tmpnam toascii tolower toupper towctrans towlower towupper ungetc ungetwc
va_arg va_copy va_end va_start vfprintf vfscanf vfwprintf vfwscanf vprintf vscanf vsnprintf vsprintf vsscanf vswprintf
vswscanf vwprintf vwscanf wcrtomb wcscat wcschr wcscmp wcscoll wcscpy wcscspn wcsftime wcslen wcsncat wcsncmp wcsncpy
wcspbrk wcsrchr wcsrtombs wcsspn wcsstr wcstod wcstof wcstoimax wcstok wcstol wcstold wcstoll wcstombs wcstoul
wcstoull wcstoumax wcsxfrm wctob wctomb wctrans wctype wmemchr wmemcmp wmemcpy wmemmove wmemset wprintf wscanf
BUFSIZ CLOCKS_PER_SEC CMPLX CMPLXF CMPLXL DBL_HAS_SUBNORM FLT_EVAL_METHOD FLT_HAS_SUBNORM FLT_RADIX FLT_ROUNDS I
LDBL_HAS_SUBNORM L_tmpnam NULL ONCE_FLAG_INIT SEEK_CUR SEEK_END SEEK_SET TIME_UTC TSS_DTOR_ITERATIONS WEOF call_once
complex imaginary kill_dependency noreturn far max min near small
std uint ushort ulong u_char u_short u_int u_long fd_set fd_mask BYTE_ORDER MAXFLOAT NFDBITS issubnormal
"""
"""Keywords of C (C17 6.4.1, C23) and C++, macros and functions of the library (C17 7), built-in functions of GCC, and
macros of Windows' headers."""

_GLSL = """
active asm atomic_uint attribute bool break buffer case cast centroid class coherent common const continue default
discard do double dvec else enum extern external false filter fixed flat float for fvec goto half highp hvec if in
inline inout input int interface invariant layout long lowp main mediump namespace noinline noperspective out output
partition patch precise precision public readonly resource restrict return sample shared short sizeof smooth static
struct subroutine superp switch template this true typedef uint uniform union unsigned using varying void volatile
while writeonly absoluteDifference addSaturate averageRounded countLeadingZeros countTrailingZeros multiply32x16
subtractSaturate abs acos acosh all allInvocations allInvocationsEqual any anyInvocation asin asinh atan atanh barrier
bitCount bitfieldExtract bitfieldInsert bitfieldReverse ceil clamp cos cosh cross dFdx dFdxCoarse dFdxFine dFdy
dFdyCoarse dFdyFine degrees determinant distance dot equal exp exp2 faceforward findLSB findMSB floatBitsToInt
floatBitsToUint floor fma fract frexp ftransform fwidth fwidthCoarse fwidthFine greaterThan greaterThanEqual
groupMemoryBarrier imageSize imulExtended intBitsToFloat interpolateAtCentroid interpolateAtOffset interpolateAtSample
inverse inversesqrt isinf isnan ldexp length lessThan lessThanEqual log log2 matrixCompMult max memoryBarrier min mix
mod modf noise1 noise2 noise3 noise4 normalize not notEqual outerProduct packDouble2x32 packHalf2x16 packSnorm2x16
packSnorm4x8 packUnorm2x16 packUnorm4x8 pow radians reflect refract round roundEven shadow1D shadow2D sign sin sinh
smoothstep sqrt step tan tanh texelFetch texelFetchOffset texture texture1D texture2D texture2DLod texture2DProj
texture3D textureCube textureGather textureGrad textureLod textureOffset textureProj textureQueryLevels
textureQueryLod textureSamples textureSize transpose trunc uaddCarry uintBitsToFloat umulExtended unpackDouble2x32
unpackHalf2x16 unpackSnorm2x16 unpackSnorm4x8 unpackUnorm2x16 unpackUnorm4x8 usubBorrow E INF NAN PI TAU fog fragment
global group_uniforms instance light process render_mode shader_type sky start vertex
"""
"""GLSL 4.60 and GLSL ES 3.20, keywords (3.6) and built-in functions (8); last the words of Godot's shading language."""

_HLSL = """
AppendStructuredBuffer BlendState Buffer ByteAddressBuffer CompileShader ComputeShader ConsumeStructuredBuffer
DepthStencilState DepthStencilView DomainShader GeometryShader Hullshader InputPatch LineStream NULL OutputPatch
PixelShader PointStream RWBuffer RWByteAddressBuffer RWStructuredBuffer RasterizerState RenderTargetView
SamplerComparisonState SamplerState StructuredBuffer TriangleStream VertexShader asm asm_fragment auto bool break case
catch cbuffer centroid char class column_major compile compile_fragment const const_cast continue default delete
discard do double dword dynamic_cast else enum explicit export extern false float for friend fxgroup goto groupshared
half if in inline inout int interface line lineadj linear long main matrix min10float min12int min16float min16int
min16uint mutable namespace new nointerpolation noperspective operator out packoffset pass pixelfragment point precise
private protected public register reinterpret_cast return row_major sample sampler shared short signed sizeof snorm
stateblock stateblock_state static static_cast string struct switch tbuffer technique technique10 technique11 template
texture this throw triangle triangleadj true try typedef typename uint uniform union unorm unsigned using vector
vertexfragment virtual void volatile while AllMemoryBarrier AllMemoryBarrierWithGroupSync CheckAccessFullyMapped
D3DCOLORtoUBYTE4 DeviceMemoryBarrier DeviceMemoryBarrierWithGroupSync EvaluateAttributeAtCentroid
EvaluateAttributeAtSample EvaluateAttributeSnapped GetRenderTargetSampleCount GetRenderTargetSamplePosition
GroupMemoryBarrier GroupMemoryBarrierWithGroupSync InterlockedAdd InterlockedAnd InterlockedCompareExchange
InterlockedCompareStore InterlockedExchange InterlockedMax InterlockedMin InterlockedOr InterlockedXor abort abs acos
all any asdouble asfloat asin asint asuint atan atan2 ceil clamp clip cos cosh countbits cross ddx ddx_coarse ddx_fine
ddy ddy_coarse ddy_fine degrees determinant distance dot dst errorf exp exp2 f16tof32 f32tof16 faceforward
firstbithigh firstbitlow floor fma fmod frac frexp fwidth isfinite isinf isnan ldexp length lerp lit log log10 log2
mad max min modf msad4 mul noise normalize pow printf radians rcp reflect refract reversebits round rsqrt saturate
sign sin sincos sinh smoothstep sqrt step tan tanh transpose trunc
"""
"""Keywords, reserved words and intrinsic functions of Microsoft's reference of HLSL."""

_WGSL = """
CompileShader ComputeShader DomainShader GeometryShader Hullshader inout signed alias break case const const_assert
continue continuing default diagnostic discard else enable false fn for if let loop override requires return struct
switch true var while NULL Self abstract active alignas alignof as asm asm_fragment async attribute auto await become
cast catch class co_await co_return co_yield coherent column_major common compile compile_fragment concept const_cast
consteval constexpr constinit crate debugger decltype delete demote demote_to_helper do dynamic_cast enum explicit
export extends extern external fallthrough filter final finally friend from fxgroup get goto groupshared highp impl
implements import inline instanceof interface layout lowp macro macro_rules match mediump meta mod module move mut
mutable namespace new nil noexcept noinline nointerpolation non_coherent noncoherent noperspective null nullptr of
operator package packoffset partition pass patch pixelfragment precise precision premerge priv protected pub public
readonly ref regardless register reinterpret_cast require resource restrict self set shared sizeof smooth snorm static
static_assert static_cast std subroutine super target template this thread_local throw trait try type typedef typeid
typename typeof union unless unorm unsafe unsized use using varying virtual volatile wgsl where with writeonly yield
array atomic bool f16 f32 i32 ptr sampler sampler_comparison u32 bitcast abs acos acosh all any arrayLength asin asinh
atan atan2 atanh ceil clamp cos cosh countLeadingZeros countOneBits countTrailingZeros cross degrees determinant
distance dot dot4I8Packed dot4U8Packed dpdx dpdxCoarse dpdxFine dpdy dpdyCoarse dpdyFine exp exp2 extractBits
faceForward firstLeadingBit firstTrailingBit floor fma fract frexp fwidth fwidthCoarse fwidthFine insertBits
inverseSqrt ldexp length log log2 max min mix modf normalize pack2x16float pack2x16snorm pack2x16unorm pack4x8snorm
pack4x8unorm pack4xI8 pack4xI8Clamp pack4xU8 pack4xU8Clamp pow quantizeToF16 radians reflect refract reverseBits round
saturate select sign sin sinh smoothstep sqrt step storageBarrier tan tanh textureBarrier textureDimensions
textureGather textureGatherCompare textureLoad textureNumLayers textureNumLevels textureNumSamples textureSample
textureSampleBaseClampToEdge textureSampleBias textureSampleCompare textureSampleCompareLevel textureSampleGrad
textureSampleLevel textureStore transpose trunc unpack2x16float unpack2x16snorm unpack2x16unorm unpack4x8snorm
unpack4x8unorm unpack4xI8 unpack4xU8 workgroupBarrier workgroupUniformLoad
"""
"""Words that naga reserves; keywords and reserved words (WGSL 16), predeclared types (6) and functions (17)."""

RESERVED = {
    "c": frozenset(_C.split()),
    "python": frozenset([*keyword.kwlist, *dir(builtins), "np"]),
    "glsl": frozenset(_GLSL.split()),
    "hlsl": frozenset(_HLSL.split()),
    "wgsl": frozenset(_WGSL.split()),
}
"""Target -> its reserved names; `FAMILIES` holds those that follow a pattern."""
FAMILIES = {
    "c": r"E[0-9A-Z]\w*|(SIG_?|LC_|FE_)[A-Z]\w*|(PRI|SCN)[a-zX]\w*|(ATOMIC|atomic|memory_order|thrd|mtx|cnd|tss)_\w+|"
    r"[A-Z]\w*_(MAX|MIN|DIG|EPSILON|EXP|C|BIT)|"
    r"\w+_t|(FP|FD|HUGE|M)_\w+|SNAN\w*|W[A-Z]+|\w+_ENDIAN|[bl]e(16|32|64)toh|hto[bl]e(16|32|64)",
    "glsl": r"gl_\w+|[bdfhiu]?vec[234]|d?mat[234](x[234])?|[iu]?(sampler|texture|image|subpassInput)[A-Z1-3]\w*|"
    r"atomic[A-Z]\w+|memoryBarrier\w+|(Emit|End)\w*(Vertex|Primitive)",
    "hlsl": r"(bool|double|dword|float|half|int|uint|min1\w+)[1-4](x[1-4])?|(RW)?Texture\w+|tex(1D|2D|3D|CUBE)\w*|"
    r"(RasterizerOrdered|Quad|GlobalOrdered)[A-Z]\w+|globallycoherent|(u?int|float)(16|32|64)_t\w*|"
    r"Wave\w+|sampler(1D|2D|3D|CUBE)?|Process\w+TessFactors\w+",
    "wgsl": r"vec[234][fhiu]?|mat[234]x[234][fh]?|texture_\w+|atomic[A-Z]\w+|quad[A-Z]\w+|subgroup[A-Z]\w+",
}
"""Target -> pattern of further reserved names."""


def is_reserved(name: str, target: str) -> bool:
    """Return whether a target's language reserves a name."""
    return name in RESERVED[target] or re.fullmatch(FAMILIES.get(target, ""), name) is not None


def lower_case_pattern(target: str) -> str:
    """Return a regular expression, also of JavaScript, of a language's reserved names without capital letters."""
    return "|".join([FAMILIES.get(target, ""), *sorted(name for name in RESERVED[target] if name.islower())])
