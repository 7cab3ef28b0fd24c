#include "shade.glsl"
// arguments.cuh: the command line, with names and meanings of `mplicits render`.
struct Arguments {
    Settings settings;
    std::vector<int> steps;     // at each level, per round
    std::vector<float> deltas;  // band half-width of each level, model units
    float time = DEFAULT_TIME;
    std::string output = "model.ppm", variant, reference;
    bool benchmark = false;
    bool sized = false, named = false;  // whether the options have --size and -o
    int frames = 200;
    double least_psnr = 40.0;
};

// Names of the shadings without "data".
inline std::string shadings() {
    std::string names;
    for (const char *name : SHADINGS)
        if (name != SHADINGS[SHADE_DATA]) names += (names.empty() ? "" : ", ") + std::string(name);
    return names;
}

inline std::string schedules() {
    std::string names = SCHEDULES[0];
    for (size_t i = 1; i < std::size(SCHEDULES); ++i) names += std::string(" or ") + SCHEDULES[i];
    return names;
}

inline void print_usage() {
    const Arguments usual;
    const Settings &s = usual.settings;
    printf(
        "usage: model [-o FILE.ppm] [--variant simple|fused] [--benchmark | --check REFERENCE.ppm]\n"
        "  --size WxH            pixels, WxH or N (default %d; --benchmark: 512 and 1024)\n"
        "  --camera AZ,EL[,DIST] azimuth, elevation, degrees; distance in radii of the shape (default %g,%g; "
        "the shape fits)\n"
        "  --fov F               vertical field of view, degrees (default %g)\n"
        "  --level L             last traced level (default: all)\n"
        "  --normal-level L      level of the normals (default: that of --level)\n"
        "  --shade S             %s; %s: raw float32 (t, steps, level, hit)\n"
        "  --iterations 20,5,5   steps at each level;  --rounds N  passes through the levels (default %d)\n"
        "  --schedule S          sphere tracing: %s (default %s)\n"
        "  --delta-scale X       factor on the band half-widths;  --step-scale X  factor on the steps (default %g)\n"
        "  --light X,Y,Z         direction towards the light: right, up, towards the viewer\n"
        "  --background C[,C]    #RRGGBB: one color, or top,bottom\n"
        "  --time T              time of a moving model, from 0 to 1\n"
        "  --benchmark           JSON: frames per second of every variant, or of --variant; --frames N (default "
        "%d)\n"
        "  --check REFERENCE     exit 1 where the picture differs from the PPM; --psnr DB: least agreement (default "
        "%g)\n"
        "One ray per pixel. The default variant is fused where the GPU has the instructions, else simple.\n",
        s.width(), AZIMUTH, ELEVATION, FOV, shadings().c_str(), SHADINGS[SHADE_DATA], s.rounds,
        schedules().c_str(), SCHEDULES[s.schedule],
        static_cast<double>(s.step_scale), usual.frames, usual.least_psnr);
}

inline double number(const std::string &option, const std::string &text) {
    char *end = nullptr;
    double value = strtod(text.c_str(), &end);
    if (text.empty() || *end != '\0' || !std::isfinite(value))
        refuse("%s %s: not a number", option.c_str(), text.c_str());
    return value;
}

inline double within(const std::string &option, const std::string &text, double low, double high) {
    double value = number(option, text);
    if (value < low || value > high) refuse("%s %s: from %g to %g", option.c_str(), text.c_str(), low, high);
    return value;
}

inline int whole(const std::string &option, const std::string &text, int low, int high) {
    double value = within(option, text, low, high);
    if (value != std::floor(value)) refuse("%s %s: a whole number is needed", option.c_str(), text.c_str());
    return static_cast<int>(value);
}

inline std::vector<std::string> parts(const std::string &text, char separator) {
    std::vector<std::string> pieces;
    std::stringstream stream(text);
    for (std::string piece; std::getline(stream, piece, separator);) pieces.push_back(piece);
    if (!text.empty() && text.back() == separator) pieces.emplace_back();
    return pieces;
}

inline vec3 color(const std::string &text) {
    const char *digits = text.c_str() + (text[0] == '#');
    char *end = nullptr;
    unsigned long value = strtoul(digits, &end, 16);
    if (strlen(digits) != 6 || *end != '\0') refuse("--background %s: RRGGBB, or RRGGBB,RRGGBB", text.c_str());
    auto channel = [&](int shift) { return static_cast<float>(value >> shift & 255u) / 255.0f; };
    return vec3(channel(16), channel(8), channel(0));
}

// Camera to model space; the y axis is up.
inline mat4 orbit(double azimuth, double elevation, double distance) {
    const double degree = std::acos(-1.0) / 180.0;
    double sa = std::sin(azimuth * degree), ca = std::cos(azimuth * degree);
    double se = std::sin(elevation * degree), ce = std::cos(elevation * degree);
    auto vector = [](double x, double y, double z) {
        return vec3(static_cast<float>(x), static_cast<float>(y), static_cast<float>(z));
    };
    return mat4(vec4(vector(ca, 0.0, -sa), 0.0f), vec4(vector(-se * sa, ce, -se * ca), 0.0f),
                vec4(vector(ce * sa, se, ce * ca), 0.0f),
                vec4(vector(distance * ce * sa, distance * se, distance * ce * ca), 1.0f));
}

// The uniform `shading` for a name.
inline int shading_named(const std::string &text) {
    const auto *end = std::end(SHADINGS), *place = std::find(std::begin(SHADINGS), end, text);
    if (place == end)
        refuse("--shade %s: %s or %s", text.c_str(), shadings().c_str(), SHADINGS[SHADE_DATA]);
    int shading = static_cast<int>(place - SHADINGS);
    if (shading == SHADE_TEXTURE && !TEXTURED) refuse("the model has no texture; use --shade phong or normal");
    return shading;
}

// The uniform `schedule` for a name.
inline int schedule_named(const std::string &text) {
    const auto *end = std::end(SCHEDULES), *place = std::find(std::begin(SCHEDULES), end, text);
    if (place == end) refuse("--schedule %s: %s", text.c_str(), schedules().c_str());
    return static_cast<int>(place - SCHEDULES);
}

inline Arguments read_arguments(int count, char **values) {
    Arguments a;
    std::map<std::string, std::string> options;
    const std::set<std::string> known = {
        "-o",      "--variant",    "--size",   "--camera",      "--fov",        "--level", "--normal-level",
        "--shade", "--iterations", "--rounds", "--delta-scale", "--step-scale", "--light", "--background",
        "--time",  "--frames",     "--check",  "--psnr",        "--schedule"};
    for (int i = 1; i < count; ++i) {
        std::string option = values[i];
        if (option == "--help" || option == "-h") {
            printf("%s\n", MODEL);
            print_usage();
            exit(0);
        } else if (option == "--benchmark") {
            a.benchmark = true;
        } else if (known.count(option) == 0) {
            refuse("%s: no such option; --help lists them", option.c_str());
        } else if (++i == count) {
            refuse("%s: a value is missing", option.c_str());
        } else {
            options[option] = values[i];
        }
    }
    auto has = [&](const char *name) { return options.count(name) != 0; };
    Settings &s = a.settings;
    a.named = has("-o");
    if (a.named) a.output = options["-o"];
    a.variant = options["--variant"];
    if (!a.variant.empty() && a.variant != "simple" && a.variant != "fused")
        refuse("--variant %s: simple or fused", a.variant.c_str());
    a.reference = options["--check"];
    if (has("--frames")) a.frames = whole("--frames", options["--frames"], 1, 100000);
    if (has("--psnr")) a.least_psnr = number("--psnr", options["--psnr"]);
    a.sized = has("--size");
    if (a.sized) {
        std::vector<std::string> sides = parts(options["--size"], 'x');
        if (sides.empty() || sides.size() > 2)
            refuse("--size: WxH in pixels, for example 640x480, or one number for a square");
        s.resolution = vec2(static_cast<float>(whole("--size", sides.front(), 1, 16384)),
                            static_cast<float>(whole("--size", sides.back(), 1, 16384)));
    }
    const double degree = std::acos(-1.0) / 180.0;
    double fov = has("--fov") ? within("--fov", options["--fov"], 1.0, 150.0) : FOV;
    double focal = 1.0 / std::tan(fov * degree / 2.0);
    s.focal = static_cast<float>(focal);
    double azimuth = AZIMUTH, elevation = ELEVATION;
    double aspect = static_cast<double>(s.width()) / s.height();
    double distance = MARGIN / std::sin(std::atan(std::fmin(1.0, aspect) / focal));
    if (has("--camera")) {
        std::vector<std::string> camera = parts(options["--camera"], ',');
        if (camera.size() != 2 && camera.size() != 3) refuse("--camera: AZ,EL or AZ,EL,DIST");
        if (camera.size() == 3) distance = within("--camera", camera[2], 1e-6, 1000.0);
        azimuth = number("--camera", camera[0]);
        elevation = number("--camera", camera[1]);
    }
    s.camera = orbit(azimuth, elevation, distance);
    if (has("--level")) s.level = whole("--level", options["--level"], 1, LEVELS);
    s.normal_level = has("--normal-level") ? whole("--normal-level", options["--normal-level"], 1, LEVELS) : s.level;
    if (has("--shade")) s.shading = shading_named(options["--shade"]);
    if (has("--rounds")) s.rounds = whole("--rounds", options["--rounds"], 1, 1000);
    if (has("--schedule")) s.schedule = schedule_named(options["--schedule"]);
    if (has("--step-scale"))
        s.step_scale = static_cast<float>(within("--step-scale", options["--step-scale"], 1e-6, 100.0));
    std::vector<std::string> steps = parts(options["--iterations"], ',');
    if (steps.size() > LEVELS) refuse("--iterations: more numbers than the model has levels (%d)", LEVELS);
    double scale = has("--delta-scale") ? within("--delta-scale", options["--delta-scale"], 1e-6, 100.0) : 1.0;
    for (size_t i = 0; i < LEVELS; ++i) {
        a.steps.push_back(steps.empty() ? ITERATIONS[i]
                                        : whole("--iterations", steps[std::min(i, steps.size() - 1)], 1, 10000));
        a.deltas.push_back(static_cast<float>(DELTAS[i] * scale));
    }
    if (has("--light")) {
        std::vector<std::string> light = parts(options["--light"], ',');
        if (light.size() != 3) refuse("--light: three numbers joined by commas");
        float xyz[3];
        for (size_t i = 0; i < 3; ++i) xyz[i] = static_cast<float>(number("--light", light[i]));
        s.light = vec3(xyz[0], xyz[1], xyz[2]);
        if (xyz[0] == 0.0f && xyz[1] == 0.0f && xyz[2] == 0.0f) refuse("--light: a direction is needed");
    }
    if (has("--background")) {
        std::vector<std::string> colors = parts(options["--background"], ',');
        if (colors.empty() || colors.size() > 2) refuse("--background: RRGGBB, or RRGGBB,RRGGBB for top,bottom");
        s.background_top = color(colors.front());
        s.background_bottom = color(colors.back());
    }
    if (has("--time") && !MOVING) refuse("--time: the model does not move");
    if (has("--time")) a.time = static_cast<float>(within("--time", options["--time"], 0.0, 1.0));
    return a;
}
