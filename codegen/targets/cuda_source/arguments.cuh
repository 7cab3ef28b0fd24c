// arguments.cuh: the command line; names and meanings are those of `mplicits render`.
const char *const USAGE =
    "usage: model [-o FILE.ppm] [--variant simple|fused|layered] [--benchmark | --check REFERENCE.ppm]\n"
    "  --size WxH            pixels, WxH or N (default 512; --benchmark: 512 and 1024)\n"
    "  --camera AZ,EL[,DIST] degrees around, degrees above, distance in radii of the shape (default 30,20; it fits)\n"
    "  --fov F               vertical field of view, degrees (default 35)\n"
    "  --level L             last level traced (default: all)\n"
    "  --normal-level L      level of the normals (default: that of --level)\n"
    "  --shade S             phong, normal, texture, depth, steps; data: raw float32 (t, steps, level, hit)\n"
    "  --iterations 20,5,5   steps at each level;  --rounds N  passes through the levels (default 32)\n"
    "  --delta-scale X       factor on the bands' widths;  --step-scale X  factor on the steps (default 0.8)\n"
    "  --light X,Y,Z         direction towards the light: right, up, towards the viewer\n"
    "  --background C[,C]    #RRGGBB: one colour, or top,bottom\n"
    "  --time T              fourth input of a field that moves\n"
    "  --benchmark           JSON: frames per second of every variant, or of the one given; --frames N (default 200)\n"
    "  --check REFERENCE     exit 1 where the picture is not that of the PPM; --psnr DB: least agreement (default 40)\n"
    "One ray per pixel. The default variant is fused where the GPU has the instructions, else simple.\n";

struct Arguments {
    Settings settings;
    std::vector<int> steps;
    std::vector<float> deltas;
    float time = 0.0f;
    std::string output = "model.ppm", variant, reference;
    bool benchmark = false, sized = false, named = false;
    int frames = 200;
    double least_psnr = 40.0;
};

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
    std::vector<std::string> found;
    std::stringstream stream(text);
    for (std::string part; std::getline(stream, part, separator);) found.push_back(part);
    if (!text.empty() && text.back() == separator) found.emplace_back();
    return found;
}

inline vec3 colour(const std::string &text) {
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

inline Shading shading(const std::string &text) {
    const std::map<std::string, Shading> names = {{"phong", SHADE_PHONG},     {"normal", SHADE_NORMAL},
                                                  {"depth", SHADE_DEPTH},     {"steps", SHADE_STEPS},
                                                  {"texture", SHADE_TEXTURE}, {"data", SHADE_DATA}};
    auto found = names.find(text);
    if (found == names.end()) refuse("--shade %s: phong, normal, texture, depth, steps or data", text.c_str());
    if (found->second == SHADE_TEXTURE && !TEXTURED) refuse("the model has no texture; use --shade phong or normal");
    return found->second;
}

inline Arguments read_arguments(int count, char **values) {
    Arguments a;
    std::map<std::string, std::string> given;
    const std::set<std::string> known = {
        "-o",      "--variant",    "--size",   "--camera",      "--fov",        "--level", "--normal-level",
        "--shade", "--iterations", "--rounds", "--delta-scale", "--step-scale", "--light", "--background",
        "--time",  "--frames",     "--check",  "--psnr"};
    for (int i = 1; i < count; ++i) {
        std::string option = values[i];
        if (option == "--help" || option == "-h") {
            printf("%s\n%s", MODEL, USAGE);
            exit(0);
        } else if (option == "--benchmark") {
            a.benchmark = true;
        } else if (known.count(option) == 0) {
            refuse("%s: no such option; --help lists them", option.c_str());
        } else if (++i == count) {
            refuse("%s: a value is missing", option.c_str());
        } else {
            given[option] = values[i];
        }
    }
    auto get = [&](const char *name, const char *other) {
        return given.count(name) ? given[name] : std::string(other);
    };
    Settings &s = a.settings;
    a.named = given.count("-o") != 0;
    a.sized = given.count("--size") != 0;
    a.output = get("-o", a.output.c_str());
    a.variant = get("--variant", "");
    if (!a.variant.empty() && a.variant != "simple" && a.variant != "fused" && a.variant != "layered") {
        refuse("--variant %s: simple, fused or layered", a.variant.c_str());
    }
    a.reference = get("--check", "");
    a.frames = whole("--frames", get("--frames", "200"), 1, 100000);
    a.least_psnr = number("--psnr", get("--psnr", "40"));
    std::vector<std::string> sides = parts(get("--size", "512"), 'x');
    if (sides.empty() || sides.size() > 2)
        refuse("--size: WxH in pixels, for example 640x480, or one number for a square");
    s.width = whole("--size", sides.front(), 1, 16384);
    s.height = whole("--size", sides.back(), 1, 16384);
    const double degree = std::acos(-1.0) / 180.0;
    double focal = 1.0 / std::tan(within("--fov", get("--fov", "35"), 1.0, 150.0) * degree / 2.0);
    s.focal = static_cast<float>(focal);
    std::vector<std::string> camera = parts(get("--camera", "30,20"), ',');
    if (camera.size() != 2 && camera.size() != 3) refuse("--camera: AZ,EL or AZ,EL,DIST");
    double fitting = 1.06 / std::sin(std::atan(std::fmin(1.0, static_cast<double>(s.width) / s.height) / focal));
    double distance = camera.size() == 3 ? within("--camera", camera[2], 1e-6, 1000.0) : fitting;
    s.camera = orbit(number("--camera", camera[0]), number("--camera", camera[1]), distance);
    s.level = whole("--level", get("--level", std::to_string(LEVELS).c_str()), 1, LEVELS);
    s.normal_level = whole("--normal-level", get("--normal-level", std::to_string(s.level).c_str()), 1, LEVELS);
    s.shading = shading(get("--shade", "phong"));
    s.rounds = whole("--rounds", get("--rounds", "32"), 1, 1000);
    s.step_scale = static_cast<float>(within("--step-scale", get("--step-scale", "0.8"), 1e-6, 100.0));
    std::vector<std::string> steps = parts(get("--iterations", ""), ',');
    if (steps.size() > LEVELS) refuse("--iterations: more numbers than the model has levels (%d)", LEVELS);
    double scale = within("--delta-scale", get("--delta-scale", "1"), 1e-6, 100.0);
    for (size_t i = 0; i < LEVELS; ++i) {
        a.steps.push_back(steps.empty() ? ITERATIONS[i]
                                        : whole("--iterations", steps[std::min(i, steps.size() - 1)], 1, 10000));
        a.deltas.push_back(static_cast<float>(DELTAS[i] * scale));
    }
    if (given.count("--light")) {
        std::vector<std::string> light = parts(given["--light"], ',');
        if (light.size() != 3) refuse("--light: three numbers joined by commas");
        float xyz[3];
        for (size_t i = 0; i < 3; ++i) xyz[i] = static_cast<float>(number("--light", light[i]));
        s.light = vec3(xyz[0], xyz[1], xyz[2]);
        if (xyz[0] == 0.0f && xyz[1] == 0.0f && xyz[2] == 0.0f) refuse("--light: a direction is needed");
    }
    if (given.count("--background")) {
        std::vector<std::string> colours = parts(given["--background"], ',');
        if (colours.empty() || colours.size() > 2) refuse("--background: RRGGBB, or RRGGBB,RRGGBB for top,bottom");
        s.background_top = colour(colours.front());
        s.background_bottom = colour(colours.back());
    }
    a.time = static_cast<float>(number("--time", get("--time", "0")));
    return a;
}
