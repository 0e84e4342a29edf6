// endowire in C#, for Unity (a script on an object with a LineRenderer) or .NET: put endowire_c.dll, libendowire_c.so or
// libendowire_c.dylib into Assets/Plugins, and scenes into Assets/StreamingAssets.
using System;
using System.Runtime.InteropServices;

public static class Endowire
{
    const string Library = "endowire_c";

    [StructLayout(LayoutKind.Sequential)]
    public struct Move
    {
        public ulong Instrument;
        public double AdvanceMm, RotateRad, Steer;
    }

    // The first fields of EndowireReport, and room for the rest: the library wants at least the size of version 1.
    [StructLayout(LayoutKind.Sequential, Size = 240)]
    public struct Report
    {
        public ulong Size;
        public double TimeS, InsertedMm, TipXMm, TipYMm, TipZMm, PushForceN, TorqueNmm;
    }

    [DllImport(Library)] public static extern uint endowire_abi_version();
    [DllImport(Library)] static extern IntPtr endowire_last_error();
    // Texts as bytes, which end with a zero: the default of C# is not UTF-8 everywhere.
    [DllImport(Library)] static extern int endowire_scene_read(byte[] path, out IntPtr scene);
    [DllImport(Library)] static extern void endowire_scene_free(IntPtr scene);
    [DllImport(Library)] static extern int endowire_simulation_new(IntPtr scene, out IntPtr simulation);
    [DllImport(Library)] static extern void endowire_simulation_free(IntPtr simulation);
    [DllImport(Library)] static extern int endowire_tick(IntPtr simulation, Move[] moves, UIntPtr count, UIntPtr solves);
    [DllImport(Library)] static extern int endowire_report(IntPtr simulation, ref Report report);
    [DllImport(Library)]
    static extern int endowire_positions_mm(IntPtr simulation, double[] positions, UIntPtr capacity, out UIntPtr count);

    static void Check(int status)
    {
        if (status != 0) throw new InvalidOperationException(Marshal.PtrToStringUTF8(endowire_last_error()));
    }

    // One thread at a time may use it.
    public sealed class Simulation : IDisposable
    {
        IntPtr handle;

        public Simulation(string scenePath)
        {
            Check(endowire_scene_read(System.Text.Encoding.UTF8.GetBytes(scenePath + "\0"), out IntPtr scene));
            int status = endowire_simulation_new(scene, out handle);
            endowire_scene_free(scene);
            Check(status);
        }

        // Moves the innermost instrument, in a time that a frame can spare.
        public Report Tick(double advanceMm, double rotateRad, uint solves = 8)
        {
            var moves = new[] { new Move { AdvanceMm = advanceMm, RotateRad = rotateRad } };
            Check(endowire_tick(handle, moves, (UIntPtr)1, (UIntPtr)solves));
            var report = new Report { Size = 240 };
            Check(endowire_report(handle, ref report));
            return report;
        }

        // x, y, z of each point, mm, in the axes of the scene (LPS, right-handed). Unity is left-handed: mirror one axis.
        public double[] PositionsMm()
        {
            Check(endowire_positions_mm(handle, null, UIntPtr.Zero, out UIntPtr count));
            var positions = new double[3 * (int)count];
            Check(endowire_positions_mm(handle, positions, count, out count));
            return positions;
        }

        public void Dispose()
        {
            endowire_simulation_free(handle);
            handle = IntPtr.Zero;
        }
    }
}
