// Seeded grasps of every kind that the interface knows, with their wrenches.
#pragma once

#include <graspforce.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

/// SplitMix64: the same numbers everywhere.
class Random {
public:
    explicit Random(std::uint64_t seed) : state_(seed) {}

    double within(double low, double high) {
        state_ += 0x9e3779b97f4a7c15ULL;
        std::uint64_t z = state_;
        z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ULL;
        z = (z ^ (z >> 27)) * 0x94d049bb133111ebULL;
        return low + (high - low) * static_cast<double>((z ^ (z >> 31)) >> 11) * std::ldexp(1.0, -53);
    }

private:
    std::uint64_t state_;
};

/// What the kinds of grasps differ by.
struct Kind {
    const char *name;
    std::size_t dim, count;
    std::uint32_t edges;
    double torsion, scale, min_normal, weight;
    int objective;
    /// Limits are spread over 10 to this power.
    double spread;
    bool symmetric;
};

const std::vector<Kind> kinds = {
    {"least maximum, edges", 3, 4, 8, 0.0, 1.0, 0.0, 0.0, GF_OBJECTIVE_MAX, 0.0, false},
    {"least sum, edges", 3, 5, 10, 0.0, 1.0, 0.0, 0.0, GF_OBJECTIVE_SUM, 0.0, false},
    {"weighted", 3, 4, 8, 0.0, 1.0, 0.0, 0.1, GF_OBJECTIVE_MAX, 0.0, false},
    {"symmetric, edges", 3, 4, 8, 0.0, 1.0, 0.0, 0.0, GF_OBJECTIVE_MAX, 0.0, true},
    {"symmetric, least sum", 3, 6, 8, 0.0, 1.0, 0.0, 0.0, GF_OBJECTIVE_SUM, 0.0, true},
    {"many contacts and edges", 3, 12, 16, 0.0, 1.0, 0.0, 0.0, GF_OBJECTIVE_MAX, 0.0, false},
    {"true cones", 3, 4, 0, 0.0, 1.0, 0.0, 0.0, GF_OBJECTIVE_MAX, 0.0, false},
    {"true cones, symmetric", 3, 4, 0, 0.0, 1.0, 0.0, 0.0, GF_OBJECTIVE_SUM, 0.0, true},
    {"soft fingers, edges", 3, 3, 8, 0.01, 1.0, 0.0, 0.0, GF_OBJECTIVE_MAX, 0.0, false},
    {"soft fingers, true cones", 3, 3, 0, 0.01, 1.0, 0.0, 0.0, GF_OBJECTIVE_MAX, 0.0, false},
    {"lower bounds, edges", 3, 4, 8, 0.0, 1.0, 0.05, 0.0, GF_OBJECTIVE_MAX, 0.0, true},
    {"lower bounds, true cones", 3, 4, 0, 0.0, 1.0, 0.05, 0.0, GF_OBJECTIVE_MAX, 0.0, true},
    {"millimetres", 3, 4, 8, 0.0, 1e-3, 0.0, 0.0, GF_OBJECTIVE_MAX, 0.0, false},
    {"limits over nine decades", 3, 4, 8, 0.0, 1.0, 0.0, 0.0, GF_OBJECTIVE_MAX, 9.0, false},
    {"true cones, limits over six decades", 3, 4, 0, 0.0, 1.0, 0.0, 0.0, GF_OBJECTIVE_MAX, 6.0, false},
    {"least squares, edges", 3, 4, 8, 0.0, 1.0, 0.0, 0.0, GF_OBJECTIVE_SQUARES, 0.0, false},
    {"least squares, true cones", 3, 4, 0, 0.0, 1.0, 0.0, 0.0, GF_OBJECTIVE_SQUARES, 0.0, true},
    {"least squares, soft fingers", 3, 4, 0, 0.01, 1.0, 0.01, 0.0, GF_OBJECTIVE_SQUARES, 3.0, false},
    {"two contacts", 3, 2, 8, 0.0, 1.0, 0.0, 0.0, GF_OBJECTIVE_MAX, 0.0, true},
    {"planar", 2, 3, 0, 0.0, 1.0, 0.0, 0.0, GF_OBJECTIVE_MAX, 0.0, false},
    {"planar, symmetric, least sum", 2, 4, 0, 0.0, 1.0, 0.0, 0.0, GF_OBJECTIVE_SUM, 0.0, true},
};

/// The arrays of a grasp.
struct Arrays {
    std::vector<double> positions, normals, friction, limits, torsion, min_normal, weights;
    std::vector<std::uint32_t> edges;
    gf_contacts contacts;

    Arrays(const Kind &kind, std::uint64_t seed) {
        Random random(seed);
        for (std::size_t i = 0; i < kind.count; ++i) {
            const double angle = 2.0 * M_PI * static_cast<double>(i) / static_cast<double>(kind.count) +
                                 (kind.symmetric ? 0.0 : random.within(-0.3, 0.3));
            const double height = kind.symmetric ? 0.0 : random.within(-0.5, 0.5);
            const std::array<double, 3> outward = {std::cos(angle), std::sin(angle), height};
            for (std::size_t k = 0; k < kind.dim; ++k) {
                const double tilt = kind.symmetric ? 0.0 : random.within(-0.2, 0.2);
                positions.push_back(kind.scale * outward[k]);
                normals.push_back(-outward[k] + tilt);
            }
            friction.push_back(kind.symmetric ? 0.5 : random.within(0.3, 0.9));
            limits.push_back(10.0 * std::pow(10.0, kind.spread == 0.0 ? 0.0 : random.within(-kind.spread, 0.0)));
            torsion.push_back(kind.torsion * kind.scale);
            min_normal.push_back(kind.min_normal);
            weights.push_back(1.0 + static_cast<double>(i));
            edges.push_back(kind.edges);
        }
        gf_contacts_init(&contacts, sizeof contacts);
        contacts.count = kind.count;
        contacts.dim = kind.dim;
        contacts.positions = positions.data();
        contacts.normals = normals.data();
        contacts.friction = friction.data();
        contacts.max_normal_force = limits.data();
        contacts.torsion = torsion.data();
        contacts.edges = edges.data();
    }
    Arrays(const Arrays &) = delete;
    Arrays &operator=(const Arrays &) = delete;

    /// Contacts that roll by a few thousandths.
    void roll(Random &random) {
        for (double &x : positions) x *= 1.0 + random.within(-1e-3, 1e-3);
        for (double &x : normals) x += random.within(-1e-3, 1e-3);
    }
};

[[noreturn]] inline void fail(const std::string &what) {
    std::fprintf(stderr, "%s\n", what.c_str());
    std::exit(1);
}

inline gf_distributor *distributor_of(const Kind &kind, const Arrays &arrays, const gf_grasp *grasp) {
    gf_distributor_options options;
    gf_distributor_options_init(&options, sizeof options);
    options.objective = kind.objective;
    options.weight = kind.weight;
    if (kind.objective == GF_OBJECTIVE_SQUARES) options.weights = arrays.weights.data();
    if (kind.min_normal > 0.0) options.min_normal = arrays.min_normal.data();
    char message[256];
    gf_distributor *distributor = nullptr;
    if (gf_distributor_create(grasp, &options, &distributor, message, sizeof message) != GF_STATUS_SOLVED)
        fail(std::string(kind.name) + ": " + message);
    return distributor;
}

inline gf_grasp *grasp_of(const Kind &kind, const Arrays &arrays) {
    char message[256];
    gf_grasp *grasp = nullptr;
    if (gf_grasp_create(&arrays.contacts, nullptr, &grasp, message, sizeof message) != GF_STATUS_SOLVED)
        fail(std::string(kind.name) + ": " + message);
    return grasp;
}
