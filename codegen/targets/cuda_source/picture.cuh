// picture.cuh: pictures as binary PPM files (P6, top row first), raw data as float32 files, and their comparison.
using Bytes = std::vector<unsigned char>;

// Rounds an image, bottom row first, to eight bits per channel like a GL framebuffer, top row first.
inline Bytes to_bytes(const std::vector<vec4> &image, int width, int height) {
    Bytes bytes;
    bytes.reserve(image.size() * 3);
    for (int y = height - 1; y >= 0; --y) {
        for (int x = 0; x < width; ++x) {
            const vec3 &c = image[static_cast<size_t>(y) * static_cast<size_t>(width) + static_cast<size_t>(x)].xyz;
            for (float channel : {c.x, c.y, c.z}) {
                bytes.push_back(
                    static_cast<unsigned char>(std::lround(255.0f * std::fmin(std::fmax(channel, 0.0f), 1.0f))));
            }
        }
    }
    return bytes;
}

inline void write_file(const std::string &name, const std::string &head, const void *data, size_t size) {
    FILE *file = fopen(name.c_str(), "wb");
    if (file == nullptr) refuse("cannot write %s: %s", name.c_str(), strerror(errno));
    bool whole = fwrite(head.data(), 1, head.size(), file) == head.size() && fwrite(data, 1, size, file) == size;
    if ((fclose(file) != 0) | !whole) refuse("cannot write %s: %s", name.c_str(), strerror(errno));
}

inline void write_ppm(const std::string &name, const std::vector<vec4> &image, int width, int height) {
    Bytes bytes = to_bytes(image, width, height);
    write_file(name, "P6\n" + std::to_string(width) + " " + std::to_string(height) + "\n255\n", bytes.data(),
               bytes.size());
}

// Writes (t, steps, level, hit) of each pixel as little-endian float32, top row first.
inline void write_data(const std::string &name, const std::vector<vec4> &image, int width, int height) {
    std::vector<vec4> rows;
    for (int y = height - 1; y >= 0; --y)
        rows.insert(rows.end(), image.begin() + y * width, image.begin() + (y + 1) * width);
    write_file(name, "", rows.data(), rows.size() * sizeof(vec4));
}

inline Bytes read_ppm(const std::string &name, int width, int height) {
    FILE *file = fopen(name.c_str(), "rb");
    if (file == nullptr) refuse("cannot read %s: %s", name.c_str(), strerror(errno));
    int file_width = 0, file_height = 0, most = 0;
    bool good =
        fscanf(file, "P6 %d %d %d", &file_width, &file_height, &most) == 3 && most == 255 && fgetc(file) != EOF;
    Bytes bytes(static_cast<size_t>(width) * static_cast<size_t>(height) * 3);
    if (good && (file_width != width || file_height != height)) {
        refuse("%s is %d x %d, the picture %d x %d; use its --size", name.c_str(), file_width, file_height, width,
               height);
    }
    good = good && fread(bytes.data(), 1, bytes.size(), file) == bytes.size();
    fclose(file);
    if (!good) refuse("%s: not a whole binary PPM (P6, 255) without comments", name.c_str());
    return bytes;
}

// Peak signal-to-noise ratio of two pictures of the same size, dB; infinite for equal pictures.
inline double psnr(const Bytes &a, const Bytes &b) {
    double sum = 0.0;
    for (size_t i = 0; i < a.size(); ++i)
        sum += (static_cast<double>(a[i]) - b[i]) * (static_cast<double>(a[i]) - b[i]);
    return 10.0 * std::log10(255.0 * 255.0 * static_cast<double>(a.size()) / sum);
}
